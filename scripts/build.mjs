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
/** Where a module is put: a folder for each, for wasm-pack optimises all that lies there. */
const packageOf = (name) => join(work, name, 'pkg');
const staging = join(work, 'dist');

/** wasm and its JavaScript glue, brotli, in KB of 1000 bytes: of the page, and of the loader that it fetches for files. */
const sizeLimits = { page: 400, loader: 600 };

const rust = ['Cargo.toml', 'Cargo.lock', 'build.rs', 'build', 'src', 'decoders', 'loader', 'shaders', 'scripts/build.mjs'];
const page = [...rust, 'www', 'package-lock.json', 'tsconfig.json'];

/** The command line is in no module. */
const apart = join(root, 'src', 'bin');

function filesOf(path) {
  if (!existsSync(path) || path === apart) return [];
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path).sort().flatMap((name) => filesOf(join(path, name)));
}

/** One hash over the names and contents of what lies at `inputs`. */
function hashOf(inputs) {
  const hash = createHash('sha256');
  for (const file of inputs.flatMap((name) => filesOf(join(root, name)))) {
    const content = readFileSync(file);
    hash.update(`${relative(root, file)}\0${content.length}\0`).update(content);
  }
  return hash.digest('hex');
}

/** Builds the module `name` of the crate in `folder`; fails where it is larger than `limit`. */
async function buildModule(folder, name, limit) {
  const options = ['--profile', 'web', '--target', 'web', '--mode', 'no-install', '--no-pack', '--out-name', name, '--out-dir', packageOf(name)];
  await run(['wasm-pack', 'build', folder, ...options]);
  const bytes = [`${name}_bg.wasm`, `${name}.js`].map((file) => brotliCompressSync(readFileSync(join(packageOf(name), file))).length);
  const [wasm, glue] = bytes.map((length) => length / 1000);
  const text = `wasm ${wasm.toFixed(0)} KB + glue ${glue.toFixed(0)} KB brotli, limit ${limit} KB`;
  if (wasm + glue > limit) throw new StepError(`too large: ${text}`);
  return text;
}

const buildWasm = () => buildModule(root, 'restir', sizeLimits.page);
const buildLoader = () => buildModule(join(root, 'loader'), 'loader', sizeLimits.loader);

async function buildPage() {
  rmSync(staging, { recursive: true, force: true });
  mkdirSync(join(staging, 'pkg'), { recursive: true });
  // With declarations: dist is also the npm package.
  await run(['tsc', '--project', root, '--noEmit', 'false', '--declaration', '--outDir', staging]);
  cpSync(join(root, 'www'), staging, { recursive: true, filter: (path) => !path.endsWith('.ts') });
  for (const name of ['restir', 'loader']) {
    for (const file of [`${name}.js`, `${name}.d.ts`, `${name}_bg.wasm`]) cpSync(join(packageOf(name), file), join(staging, 'pkg', file));
  }
  // The old page stays whole until the new one is.
  rmSync(dist, { recursive: true, force: true });
  renameSync(staging, dist);
}

const parts = [
  { name: 'wasm', inputs: rust, work: buildWasm },
  { name: 'loader', inputs: rust, work: buildLoader },
  { name: 'page', inputs: page, work: buildPage },
];

/** Builds dist/, but for those parts of which nothing has changed since they were built. */
export async function build() {
  let changed = !existsSync(dist);
  for (const { name, inputs, work: make } of parts) {
    const stamp = join(work, `stamp-${name}`);
    const hash = hashOf(inputs);
    if ((name !== 'page' || !changed) && existsSync(stamp) && readFileSync(stamp, 'utf8') === hash) continue;
    changed = true;
    rmSync(stamp, { force: true });
    await step(`build: ${name}`, make);
    writeFileSync(stamp, hash);
  }
  if (!changed) console.log('build: nothing changed');
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  await script(async () => {
    await setup('build');
    await build();
  });
}
