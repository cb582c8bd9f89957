// The package where other tools and pages have it: bundled by Vite, and in frames.
import { strict as assert } from 'node:assert';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { dist } from '../../scripts/build.mjs';
import { root } from '../../scripts/environment.mjs';
import { assertNoProblems, openEmbedding, openPage } from './pages.mjs';

let folder;
let site;
before(async () => {
  site = await openEmbedding();
  ({ folder } = site);
});
after(() => site?.close());

const element = '<restir-viewer src="builtin:cornell" technique="normals" scale="1" max-samples="1" style="width: 64px; height: 48px"></restir-viewer>';

/** How many values the picture in this frame of a page has, once it has a picture: a picture of nothing has few. */
async function valuesOf(frame) {
  await frame.waitForFunction(async () => (await document.querySelector('restir-viewer')?.viewer?.call((viewer) => viewer.frames())) >= 1, { polling: 50 });
  return frame.evaluate(async () => new Set((await document.querySelector('restir-viewer').viewer.capture({ type: 'rgba' })).data).size);
}

async function withPage(path, work) {
  const { page, problems } = await openPage(site, path);
  try {
    await work(page);
    // No page has an icon, which browsers ask for.
    assertNoProblems(problems.filter((text) => !/favicon|404/.test(text)));
  } finally {
    await page.close();
  }
}

test('a project that Vite builds shows a picture, of a file too', async (context) => {
  const project = join(folder, 'project');
  mkdirSync(project);
  const call = (...words) => execFileSync(words[0], words.slice(1), { cwd: project, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
  const [{ filename }] = JSON.parse(call('npm', 'pack', root, '--json', '--ignore-scripts'));
  writeFileSync(join(project, 'package.json'), '{ "name": "project", "private": true, "type": "module" }');
  call('npm', 'install', '--offline', '--no-audit', '--no-fund', `./${filename}`);
  writeFileSync(join(project, 'index.html'), `<!doctype html><title>Vite</title>${element}<script type="module" src="main.js"></script>`);
  writeFileSync(join(project, 'main.js'), "import 'restir/element';\n");
  writeFileSync(join(project, 'vite.config.js'), "export default { base: './' };\n");
  context.diagnostic(call(process.execPath, join(root, 'node_modules', 'vite', 'bin', 'vite.js'), 'build').trim().split('\n').at(-1));
  const built = readdirSync(join(project, 'dist', 'assets'));
  for (const wanted of [/^restir_bg.*\.wasm$/, /^loader_bg.*\.wasm$/, /^worker.*\.js$/]) assert.ok(built.some((name) => wanted.test(name)), `${wanted} is not among ${built}`);

  const triangle = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer).toString('base64');
  const gltf = {
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    buffers: [{ byteLength: 36, uri: `data:application/octet-stream;base64,${triangle}` }], bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
  };
  writeFileSync(join(project, 'dist', 'triangle.gltf'), JSON.stringify(gltf));
  await withPage('project/dist/', async (page) => {
    assert.ok((await valuesOf(page)) > 10, 'the picture is empty');
    // Files are read by a module that the worker fetches.
    await page.evaluate(() => document.querySelector('restir-viewer').viewer.load('triangle.gltf'));
    assert.ok((await valuesOf(page)) > 2, 'the picture of the file is empty');
  });
});

test('frames show a picture: of this site, of another one, in a sandbox', async () => {
  writeFileSync(join(folder, 'inner.html'), `<!doctype html><title>Inner</title>${element}<script type="module" src="restir/element.js"></script>`);
  for (const [name, attributes] of [
    ['own', 'src="inner.html"'],
    // Another host name is another site.
    ['other', `src="${site.url.replace('localhost', '127.0.0.1')}inner.html"`],
    ['sandbox', 'src="inner.html" sandbox="allow-scripts allow-same-origin"'],
  ]) {
    writeFileSync(join(folder, `${name}.html`), `<!doctype html><title>Outer</title><iframe ${attributes} style="width: 300px; height: 200px"></iframe>`);
    await withPage(`${name}.html`, async (page) => {
      const frame = await page.waitForFrame((each) => each.url().endsWith('inner.html'));
      assert.ok((await valuesOf(frame)) > 10, `${name}: the picture is empty`);
    });
  }
});
