// cargo test, with its programs side by side: while one compiles kernels, which keeps one processor busy, the other goes on.
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { StepError, execute, run } from './run.mjs';
import { root } from './environment.mjs';

/** Seconds that each program took when it last passed: the longest start first. */
const timesFile = join(root, 'target', 'rust-test-times.json');

/** What `cargo test` calls a target of a kind, as in `--test truth`. */
const selector = ({ kind: [kind], name }) => (kind === 'test' || kind === 'bin' ? `--${kind} ${name}` : '--lib');

/** Compiles all test programs of the package: how `cargo test` is told of each, and its path. */
async function build(env) {
  const output = await run(['cargo', 'test', '--quiet', '--no-run', '--message-format=json-render-diagnostics'], { env });
  const artifacts = output.split('\n').filter((line) => line.startsWith('{')).map((line) => JSON.parse(line));
  const programs = artifacts.filter(({ profile, executable }) => profile?.test && executable);
  return programs.map(({ target, executable }) => ({ name: selector(target), path: executable }));
}

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
  const expected = ({ name }) => times[name] ?? Infinity;
  const queue = (await build(env)).sort((a, b) => expected(b) - expected(a));
  let passed = 0;
  const worker = async () => {
    for (let program = queue.shift(); program; program = queue.shift()) {
      const start = performance.now();
      const { code, output } = await execute([program.path, ...options], { env });
      if (code !== 0) {
        queue.length = 0;
        throw new StepError(`${output.trimEnd()}\n\nfailed (exit code ${code}): cargo test ${program.name}`);
      }
      passed += passedIn(output);
      if (!whole) times[program.name] = Math.round((performance.now() - start) / 100) / 10;
    }
  };
  await Promise.all(Array.from({ length: availableParallelism() }, worker));
  passed += passedIn(await run(['cargo', 'test', '--doc'], { env }));
  writeFileSync(timesFile, JSON.stringify(times, null, 2));
  const slowest = Object.entries(times).sort(([, a], [, b]) => b - a).slice(0, 3);
  return `${passed} passed; longest: ${slowest.map(([name, seconds]) => `${name} ${seconds} s`).join(', ')}`;
}
