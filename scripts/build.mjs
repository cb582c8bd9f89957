// npm run build: the wasm module and the page, as static files in dist/.
import { createHash } from 'node:crypto';
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, renameSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync } from 'node:zlib';
import { root } from './environment.mjs';
import { StepError, run, script, step } from './run.mjs';
import { setup } from './setup.mjs';

/** The finished page. */
export const dist = join(root, 'dist');

const work = join(root, 'target', 'web');
const wasmPackage = join(work, 'pkg');
/** The second module, of what only some files need, lies beside the first: there the page's types look for it. */
const decoderPackage = wasmPackage;
const staging = join(work, 'dist');
const stamp = join(work, 'stamp');

/** wasm and its JavaScript glue, brotli, in KB of 1000 bytes: of the page, and of the decoders that it fetches on demand. */
const sizeLimits = { page: 500, decoders: 345 };

const inputs = ['Cargo.toml', 'Cargo.lock', 'build.rs', 'src', 'decoders', 'shaders', 'www', 'scripts', 'package-lock.json', 'tsconfig.json'];

function filesOf(path) {
  if (!existsSync(path)) return [];
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).sort().flatMap((name) => filesOf(join(path, name)));
}

/** One hash over the names and contents of everything the build reads. */
function inputHash() {
  const hash = createHash('sha256');
  for (const file of inputs.flatMap((name) => filesOf(join(root, name)))) {
    const content = readFileSync(file);
    hash.update(`${relative(root, file)}\0${content.length}\0`).update(content);
  }
  return hash.digest('hex');
}

const isCurrent = (hash) => existsSync(dist) && existsSync(stamp) && readFileSync(stamp, 'utf8') === hash;

/** Builds the module `name` of the crate in `folder` into `out`; fails where it is larger than `limit`. */
async function buildModule(folder, name, out, limit, features = []) {
  const options = ['--profile', 'web', '--target', 'web', '--mode', 'no-install', '--no-pack', '--out-name', name, '--out-dir', out];
  await run(['wasm-pack', 'build', folder, ...options, ...features]);
  const bytes = [`${name}_bg.wasm`, `${name}.js`].map((file) => brotliCompressSync(readFileSync(join(out, file))).length);
  const [wasm, glue] = bytes.map((length) => length / 1000);
  const text = `wasm ${wasm.toFixed(0)} KB + glue ${glue.toFixed(0)} KB brotli, limit ${limit} KB`;
  if (wasm + glue > limit) throw new StepError(`too large: ${text}`);
  return text;
}

const buildWasm = () => buildModule(root, 'restir', wasmPackage, sizeLimits.page);
const buildDecoders = () =>
  buildModule(join(root, 'decoders'), 'decoders', decoderPackage, sizeLimits.decoders, ['--', '--features', 'module']);

async function buildPage() {
  rmSync(staging, { recursive: true, force: true });
  mkdirSync(join(staging, 'pkg'), { recursive: true });
  await run(['tsc', '--project', root, '--noEmit', 'false', '--outDir', staging]);
  for (const name of readdirSync(join(root, 'www')).filter((file) => !file.endsWith('.ts'))) {
    cpSync(join(root, 'www', name), join(staging, name), { recursive: true });
  }
  for (const [folder, name] of [[wasmPackage, 'restir'], [decoderPackage, 'decoders']]) {
    for (const file of [`${name}.js`, `${name}_bg.wasm`]) cpSync(join(folder, file), join(staging, 'pkg', file));
  }
  // The old page stays whole until the new one is.
  rmSync(dist, { recursive: true, force: true });
  renameSync(staging, dist);
}

/** Builds dist/ unless nothing it depends on has changed since the last build. */
export async function build() {
  const hash = inputHash();
  if (isCurrent(hash)) {
    console.log('build: nothing changed');
    return;
  }
  rmSync(stamp, { force: true });
  await step('build: wasm', buildWasm);
  await step('build: decoders', buildDecoders);
  await step('build: page', buildPage);
  writeFileSync(stamp, hash);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  await script(async () => {
    await setup('build');
    await build();
  });
}
