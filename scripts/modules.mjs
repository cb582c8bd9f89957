// The wasm modules: the renderer, and the loader of files. Apart from build.mjs, for a change in here builds them anew, which
// takes minutes.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { brotliCompressSync } from 'node:zlib';
import { root } from './environment.mjs';
import { StepError, run } from './run.mjs';

/** Where builds keep what they need again. */
export const work = join(root, 'target', 'web');

/** Where a module is put: a folder for each, for wasm-pack optimises all that lies there. */
export const packageOf = (name) => join(work, name, 'pkg');

/** What the modules are made from. */
export const moduleInputs = ['Cargo.toml', 'Cargo.lock', 'build.rs', 'build', 'src', 'decoders', 'loader', 'shaders', 'scripts/modules.mjs'];

/** Builds the module `name` of the crate in `folder`; fails where wasm and glue, brotli, are larger than `limit` KB of 1000 bytes. */
async function buildModule(folder, name, limit) {
  const options = ['--profile', 'web', '--target', 'web', '--mode', 'no-install', '--no-pack', '--out-name', name, '--out-dir', packageOf(name)];
  await run(['wasm-pack', 'build', folder, ...options]);
  const bytes = [`${name}_bg.wasm`, `${name}.js`].map((file) => brotliCompressSync(readFileSync(join(packageOf(name), file))).length);
  const [wasm, glue] = bytes.map((length) => length / 1000);
  const text = `wasm ${wasm.toFixed(0)} KB + glue ${glue.toFixed(0)} KB brotli, limit ${limit} KB`;
  if (wasm + glue > limit) throw new StepError(`too large: ${text}`);
  return text;
}

/** What the page begins with. */
export const buildWasm = () => buildModule(root, 'restir', 420);

/** What it fetches for a file. */
export const buildLoader = () => buildModule(join(root, 'loader'), 'loader', 600);
