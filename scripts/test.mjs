// npm test: everything but proofs that take minutes, which `npm run prove` adds. One line per step; the first failure ends the
// run with its output.
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { root, softwareEnvironment } from './environment.mjs';
import { build } from './build.mjs';
import { run, script, step } from './run.mjs';
import { rustTests } from './rust-tests.mjs';
import { setup } from './setup.mjs';

const lastLine = (output) => output.trim().split('\n').at(-1);

/** Node's test runner ends with `# pass N` among its counts. */
const nodeSummary = (output) => `${/^. pass (\d+)/m.exec(output)?.[1] ?? 0} passed`;

/** The one that times the first picture runs first, on the quietest machine. */
const browserTestFiles = readdirSync(join(root, 'tests', 'browser'))
  .filter((name) => name.endsWith('.test.mjs'))
  .sort((a, b) => Number(b.startsWith('first')) - Number(a.startsWith('first')) || (a < b ? -1 : 1))
  .map((name) => join('tests', 'browser', name));

const browserTests = (browser, env) => async () =>
  nodeSummary(await run(['node', '--test', '--test-concurrency=1', '--test-reporter=spec', ...browserTestFiles], { env: { ...env, BROWSER: browser } }));

function steps() {
  const env = softwareEnvironment();
  const cargo = async (...words) => {
    await run(['cargo', ...words], { env });
  };
  return [
    ['format', () => cargo('fmt', '--check')],
    ['clippy', () => cargo('clippy', '--all-targets', '--', '-D', 'warnings')],
    // In release, so that the page's build finds its build dependencies made.
    ['clippy, wasm', () => cargo('clippy', '--release', '--workspace', '--lib', '--target', 'wasm32-unknown-unknown', '--', '-D', 'warnings')],
    ['rust tests', () => rustTests(env, { whole: process.argv.includes('--whole') })],
    ['tint', async () => lastLine(await run(['node', 'scripts/tint.mjs']))],
    ['page', () => build()],
    ['site', async () => nodeSummary(await run(['node', '--test', '--test-reporter=spec', 'tests/site.test.mjs']))],
    ['types', () => run(['tsc', '--project', '.']).then(() => undefined)],
    ['chromium', browserTests('chromium', env)],
    ['firefox', browserTests('firefox', env)],
  ];
}

await script(async () => {
  await setup('test');
  let passed = 0;
  try {
    for (const [name, work] of steps()) {
      await step(name, work);
      passed += 1;
    }
  } catch (error) {
    console.error(error.message);
    process.exitCode = 1;
  }
  console.log(`${passed} passed, ${process.exitCode ? 1 : 0} failed`);
});
