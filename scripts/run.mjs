// Runs one command, or reports one step, in one line.
import { spawn } from 'node:child_process';
import { environment, root } from './environment.mjs';

/** A failure that is explained by its message alone: no stack is shown. */
export class StepError extends Error {}

/** The command as a person would type it. */
export const asText = (command) => command.map((word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word}'`)).join(' ');

/**
 * Runs `command` (an argument vector) in the repository root without a stdin.
 * Resolves to its exit code and its stdout and stderr, interleaved. A missing program is code 127.
 */
export function execute(command, { env = environment } = {}) {
  return new Promise((resolve) => {
    const child = spawn(command[0], command.slice(1), { cwd: root, env, stdio: ['ignore', 'pipe', 'pipe'] });
    let output = '';
    for (const stream of [child.stdout, child.stderr]) stream.setEncoding('utf8').on('data', (text) => (output += text));
    child.on('error', (error) => resolve({ code: 127, output: String(error.message) }));
    child.on('close', (code, signal) => resolve({ code: code ?? 128, output: signal ? `${output}\nended by ${signal}` : output }));
  });
}

/** As `execute`, but throws a `StepError` with the command and its output where the exit code is not 0. */
export async function run(command, options) {
  const { code, output } = await execute(command, options);
  if (code !== 0) throw new StepError(`${output.trimEnd()}\n\nfailed (exit code ${code}): ${asText(command)}`);
  return output;
}

/** Runs `work` and prints one line: name, seconds, and what `work` resolved to, if that is text. */
export async function step(name, work) {
  process.stdout.write(`${name} … `);
  const start = performance.now();
  try {
    const note = await work();
    console.log(`${((performance.now() - start) / 1000).toFixed(1)} s${typeof note === 'string' ? `  ${note}` : ''}`);
  } catch (error) {
    console.log('FAILED');
    throw error;
  }
}

/** Runs a script's `main`; a failure is printed and becomes exit code 1. */
export async function script(main) {
  try {
    await main();
  } catch (error) {
    console.error(error instanceof StepError ? error.message : error);
    process.exitCode = 1;
  }
}
