// npm run build: the wasm modules, the page, the tutorials and the documentation, as static files in dist/.
import { createHash } from 'node:crypto';
import { cpSync, existsSync, mkdirSync, readFileSync, readdirSync, renameSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';
import { root } from './environment.mjs';
import { buildLoader, buildWasm, moduleInputs, packageOf, work } from './modules.mjs';
import { run, script, step } from './run.mjs';
import { setup } from './setup.mjs';

/** The finished site. */
export const dist = join(root, 'dist');

const staging = join(work, 'dist');

const siteInputs = ['docs', 'README.md', 'CONTRIBUTING.md', 'CHANGELOG.md', 'scripts/site.mjs', 'scripts/markdown.mjs', 'scripts/api-reference.mjs'];
const pageInputs = [...moduleInputs, ...siteInputs, 'scripts/build.mjs', 'www', 'package-lock.json', 'tsconfig.json'];

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

async function buildPage() {
  rmSync(staging, { recursive: true, force: true });
  mkdirSync(join(staging, 'pkg'), { recursive: true });
  // With declarations: dist is also the npm package.
  await run(['tsc', '--project', root, '--noEmit', 'false', '--declaration', '--outDir', staging]);
  cpSync(join(root, 'www'), staging, { recursive: true, filter: (path) => !path.endsWith('.ts') });
  for (const name of ['restir', 'loader']) {
    for (const file of [`${name}.js`, `${name}.d.ts`, `${name}_bg.wasm`]) cpSync(join(packageOf(name), file), join(staging, 'pkg', file));
  }
  // Fetched only now, for it needs packages that setup may just have installed.
  const { buildSite } = await import('./site.mjs');
  buildSite(staging);
  // The old page stays whole until the new one is.
  rmSync(dist, { recursive: true, force: true });
  renameSync(staging, dist);
}

const parts = [
  { name: 'wasm', inputs: moduleInputs, make: buildWasm },
  { name: 'loader', inputs: moduleInputs, make: buildLoader },
  { name: 'page', inputs: pageInputs, make: buildPage },
];

/** Builds dist/, but for those parts of which nothing has changed since they were built. */
export async function build() {
  let changed = !existsSync(dist);
  for (const { name, inputs, make } of parts) {
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
