// cargo test, with its programs side by side: each keeps little more than one processor busy, for drivers compile one kernel
// after another and small pictures are soon computed.
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import { basename, join } from 'node:path';
import { StepError, execute, run } from './run.mjs';
import { root } from './environment.mjs';

/** Seconds that each program took when it last passed, by name: the longest start first. */
const timesFile = join(root, 'target', 'rust-test-times.json');

/** Compiles all test programs of the package; their paths. */
async function build(env) {
  const output = await run(['cargo', 'test', '--quiet', '--no-run', '--message-format=json-render-diagnostics'], { env });
  const artifacts = output.split('\n').filter((line) => line.startsWith('{')).map((line) => JSON.parse(line));
  return artifacts.filter(({ profile, executable }) => profile?.test && executable).map(({ executable }) => executable);
}

/** `truth` of `target/debug/deps/truth-0123456789abcdef`. */
const nameOf = (program) => basename(program).replace(/-[0-9a-f]+$/, '');

/** Adds up the `test result:` lines. */
const passedIn = (output) => [...output.matchAll(/^test result: ok\. (\d+) passed/gm)].reduce((sum, [, count]) => sum + Number(count), 0);

/**
 * Builds and runs everything that `cargo test` does; with `whole` also what it ignores, and proofs in full. Resolves to a summary;
 * the first program that fails ends it, with its output.
 */
export async function rustTests(env, { whole }) {
  const options = whole ? ['--include-ignored'] : [];
  if (whole) env = { ...env, RESTIR_PROVE: '1' };
  const times = existsSync(timesFile) ? JSON.parse(readFileSync(timesFile, 'utf8')) : {};
  const expected = (program) => times[nameOf(program)] ?? Infinity;
  const queue = (await build(env)).sort((a, b) => expected(b) - expected(a));
  let passed = 0;
  const worker = async () => {
    for (let program = queue.shift(); program; program = queue.shift()) {
      const start = performance.now();
      const { code, output } = await execute([program, ...options], { env });
      if (code !== 0) {
        queue.length = 0;
        throw new StepError(`${output.trimEnd()}\n\nfailed (exit code ${code}): cargo test --test ${nameOf(program)}`);
      }
      passed += passedIn(output);
      if (!whole) times[nameOf(program)] = Math.round((performance.now() - start) / 100) / 10;
    }
  };
  await Promise.all(Array.from({ length: availableParallelism() }, worker));
  passed += passedIn(await run(['cargo', 'test', '--doc'], { env }));
  writeFileSync(timesFile, JSON.stringify(times, null, 2));
  const slowest = Object.entries(times).sort(([, a], [, b]) => b - a).slice(0, 3);
  return `${passed} passed; longest: ${slowest.map(([name, seconds]) => `${name} ${seconds} s`).join(', ')}`;
}
