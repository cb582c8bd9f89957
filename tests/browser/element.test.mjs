// <restir-viewer> and RestirViewer in pages that are not restir's own, and the npm package.
import { strict as assert } from 'node:assert';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { root } from '../../scripts/environment.mjs';
import { browserName } from './browsers.mjs';
import { assertNoProblems, contrast, openEmbedding, openPage, readDisplay, waitForFrames } from './pages.mjs';

let folder;
let site;
before(async () => {
  site = await openEmbedding();
  ({ folder } = site);
});
after(() => site?.close());

let pages = 0;

/** Runs `work` on a page of this HTML, which must end without a problem on the console. */
async function withHtml(html, work, prepare) {
  const name = `page-${pages++}.html`;
  writeFileSync(join(folder, name), html);
  const { page, problems } = await openPage(site, name, prepare);
  try {
    await work(page);
    // No page has an icon, which browsers ask for.
    assertNoProblems(problems.filter((text) => !/favicon|404/.test(text)));
  } finally {
    await page.close();
  }
}

const withElement = (attributes, work, prepare) =>
  withHtml(
    `<!doctype html>
    <style>restir-viewer { width: 64px; height: 48px; }</style>
    <script>
      const told = [];
      let pictures = 0;
      const tell = (element) => {
        for (const type of ['error', 'devicelost', 'restored', 'load']) element.addEventListener(type, ({ detail }) => told.push({ type, ...detail }));
        element.addEventListener('sample', () => (pictures += 1));
      };
    </script>
    <restir-viewer scale="1" ${attributes}></restir-viewer>
    <script>tell(document.querySelector('restir-viewer'));</script>
    <script type="module" src="restir/element.js"></script>`,
    work,
    prepare,
  );

/** Waits until `frames` frames are averaged. */
const untilFrames = (page, frames) =>
  page.waitForFunction(async (wanted) => (await document.querySelector('restir-viewer').viewer?.call((viewer) => viewer.frames())) >= wanted, { polling: 50 }, frames);

/** The element's picture: three bytes a pixel. */
async function picture(page) {
  const bytes = await page.evaluate(async () => {
    const { data, width, height } = await document.querySelector('restir-viewer').viewer.capture({ type: 'rgba' });
    return [width, height, ...data.filter((_, at) => at % 4 < 3)];
  });
  assert.deepEqual(bytes.slice(0, 2), [64, 48]);
  return Uint8Array.from(bytes.slice(2));
}

const set = (page, name, value) => page.evaluate((key, text) => document.querySelector('restir-viewer').setAttribute(key, text), name, value);

/** Waits for an event of this type; returns what it told, and what the element says. What came before it is forgotten. */
async function told(page, type) {
  await page.waitForFunction((wanted) => told.some((event) => event.type === wanted), { polling: 50 }, type);
  return page.evaluate((wanted) => {
    const found = told.find((event) => event.type === wanted);
    told.splice(0, told.indexOf(found) + 1);
    return { code: found.code, message: found.message, final: found.final, shown: document.querySelector('restir-viewer').shadowRoot.querySelector('p').innerText };
  }, type);
}

async function pageDisplay(query, frames) {
  const { page, problems } = await openPage(site, `restir/${query}`);
  await waitForFrames(page, frames);
  const rgb = await readDisplay(page);
  assertNoProblems(problems);
  await page.close();
  return rgb;
}

test("the element's picture is the page's, and each attribute is live", () =>
  withElement('src="builtin:cornell" technique="path-tracer" seed="1" max-samples="4"', async (page) => {
    await untilFrames(page, 4);
    const first = await picture(page);
    assert.ok(contrast(first, 64, 48) > 40, 'the picture is flat');
    assert.deepEqual(first, await pageDisplay('?scene=cornell&technique=path-tracer&seed=1&size=64x48&frames=4', 4));

    // Fewer frames than there are: nothing to do until something changes.
    await set(page, 'max-samples', '2');
    await set(page, 'params', 'render.max_depth=1 film.exposure=1');
    await set(page, 'seed', '5');
    const values = () => page.evaluate(() => [...document.querySelector('restir-viewer').viewer.settings.values].map((pair) => pair.join('=')).sort().join(' '));
    await page.waitForFunction(() => document.querySelector('restir-viewer').viewer.settings.values.size === 2, { polling: 50 });
    await untilFrames(page, 2);
    assert.equal(await values(), 'film.exposure=1 render.max_depth=1');
    assert.deepEqual(await picture(page), await pageDisplay('?scene=cornell&technique=path-tracer&seed=5&size=64x48&frames=2&render.max_depth=1&film.exposure=1', 2));

    await set(page, 'technique', 'normals');
    await set(page, 'params', '');
    await page.waitForFunction(() => document.querySelector('restir-viewer').viewer.settings.technique === 'normals', { polling: 50 });
    await set(page, 'src', 'furnace');
    await page.waitForFunction(() => document.querySelector('restir-viewer').viewer.settings.scene === 'furnace', { polling: 50 });
    await untilFrames(page, 2);
    assert.deepEqual(await picture(page), await pageDisplay('?scene=furnace&technique=normals&seed=5&size=64x48&frames=2', 2));
    const link = await page.evaluate(() => document.querySelector('restir-viewer').viewer.shareUrl());
    assert.equal(link, `${site.url}restir/?scene=furnace&technique=normals&seed=5&accumulate=yes&scale=1&frames=2`);
  }));

test('a wrong name or value is one message and one event with a code, and the picture stays', () =>
  withElement('src="builtin:cornell" technique="normals" max-samples="1"', async (page) => {
    await untilFrames(page, 1);
    for (const [name, wrong, code, words, right] of [
      ['technique', 'bogus', 'UNKNOWN_NAME', /bogus/, 'normals'],
      ['params', 'film.exposure=loud', 'BAD_VALUE', /exposure/, ''],
      ['params', 'nonsense', 'BAD_VALUE', /nonsense/, ''],
      ['view', 'bogus', 'UNKNOWN_NAME', /bogus/, 'radiance'],
      ['camera', 'bogus', 'UNKNOWN_NAME', /bogus/, '0'],
      ['camera', '1,2', 'BAD_VALUE', /nine numbers/, '0'],
      ['seed', '-1', 'BAD_VALUE', /seed/, '0'],
      ['time', 'noon', 'BAD_VALUE', /noon/, '0'],
      ['scale', '9', 'BAD_VALUE', /scale/, '1'],
      ['src', 'missing.glb', 'IO', /missing\.glb: the server says 404/, 'builtin:cornell'],
      ['src', 'builtin:bogus', 'UNKNOWN_NAME', /bogus/, 'builtin:cornell'],
    ]) {
      const good = await picture(page);
      await set(page, name, wrong);
      const failure = await told(page, 'error');
      assert.equal(failure.code, code, `${name}=${wrong}: ${failure.message}`);
      assert.match(failure.message, words);
      assert.ok(failure.shown.includes(failure.message), `the element says: ${failure.shown}`);
      assert.deepEqual(await picture(page), good, `after ${name}=${wrong}`);
      await set(page, name, right);
      await page.waitForFunction(() => document.querySelector('restir-viewer').shadowRoot.querySelector('p').hidden, { polling: 50 });
      if (name === 'src') await told(page, 'load');
      await untilFrames(page, 1);
      // Whatever was asked for has been done when this has.
      await page.evaluate(() => document.querySelector('restir-viewer').viewer.reset());
      await untilFrames(page, 1);
    }
  }));

test('a scene by its address, with the files that it names', () => {
  const positions = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const gltf = (uri) => ({
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    buffers: [{ byteLength: 36, uri }], bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
  });
  mkdirSync(join(folder, 'models', 'a b'), { recursive: true });
  writeFileSync(join(folder, 'models', 'a b', 'data.bin'), positions);
  writeFileSync(join(folder, 'models', 'apart.gltf'), JSON.stringify(gltf('a%20b/data.bin')));
  writeFileSync(join(folder, 'models', 'whole.gltf'), JSON.stringify(gltf(`data:application/octet-stream;base64,${positions.toString('base64')}`)));
  return withElement('src="models/apart.gltf" technique="normals" max-samples="1"', async (page) => {
    await untilFrames(page, 1);
    const apart = await picture(page);
    assert.ok(new Set(apart).size > 2, 'nothing is shown');
    await set(page, 'src', 'models/whole.gltf');
    await page.waitForFunction(() => document.querySelector('restir-viewer').viewer.settings.scene.endsWith('whole.gltf'), { polling: 50 });
    await untilFrames(page, 1);
    assert.deepEqual(await picture(page), apart);
  });
});

test('out of view nothing is given to the GPU, and removal ends it', () =>
  withElement(
    'src="builtin:cornell" technique="normals" style="display: block"',
    async (page) => {
      await untilFrames(page, 2);
      const move = (top) => page.evaluate((y) => (document.querySelector('restir-viewer').style.marginTop = y), top);
      const submits = async (milliseconds) => {
        const before = await page.evaluate(() => submitted);
        await new Promise((resolve) => setTimeout(resolve, milliseconds));
        return (await page.evaluate(() => submitted)) - before;
      };
      assert.ok((await submits(1500)) > 0, 'in view it renders');
      await move('5000px');
      await page.waitForFunction(() => document.querySelector('restir-viewer').viewer.suspended, { polling: 50 });
      // The frame that was begun is finished.
      await submits(1000);
      assert.equal(await submits(1000), 0, 'out of view it does not');
      await move('0');
      await page.waitForFunction((before) => submitted > before, { polling: 50 }, await page.evaluate(() => submitted));

      const outcome = await page.evaluate(async () => {
        const element = document.querySelector('restir-viewer');
        const { viewer } = element;
        element.remove();
        await new Promise((resolve) => setTimeout(resolve));
        return [element.viewer === undefined, await viewer.reset().catch(({ code }) => code)];
      });
      assert.deepEqual(outcome, [true, 'DISPOSED']);
      await submits(1000);
      assert.equal(await submits(1000), 0, 'removed it does nothing');
    },
    () => {
      window.submitted = 0;
      const { submit } = GPUQueue.prototype;
      GPUQueue.prototype.submit = function (...given) {
        window.submitted += 1;
        return submit.apply(this, given);
      };
    },
  ));

/** Keeps the devices of the page, for tests to destroy. One that a page destroys is lost for the reason `destroyed`, which the renderer takes for its own doing. */
const destructible = () => {
  window.devices = [];
  const { requestDevice } = GPUAdapter.prototype;
  GPUAdapter.prototype.requestDevice = async function (...given) {
    const device = await requestDevice.apply(this, given);
    const lost = device.lost.then(async ({ message }) => ({ reason: await device.tell?.() ?? 'unknown', message: message || 'destroyed' }));
    Object.defineProperty(device, 'lost', { value: lost });
    window.devices.push(device);
    return device;
  };
};

// Firefox goes on silently with a device that the page has destroyed: `lost` is not told to the module.
const onlyChromium = { skip: browserName !== 'chromium' };

test('a destroyed device is replaced, and after a second one the viewer gives up', onlyChromium, () =>
  withElement(
    'src="builtin:cornell" technique="normals" max-samples="3"',
    async (page) => {
      await untilFrames(page, 3);
      const before = await picture(page);
      const destroy = () =>
        page.evaluate(() => {
          devices.at(-1).destroy();
          void document.querySelector('restir-viewer').viewer.reset();
        });
      await destroy();
      assert.equal((await told(page, 'devicelost')).final, false);
      await told(page, 'restored');
      await untilFrames(page, 3);
      assert.deepEqual(await picture(page), before);
      await destroy();
      const failure = await told(page, 'error');
      assert.equal(failure.code, 'DEVICE');
      assert.match(failure.shown, /device was lost/);
      assert.equal(await page.evaluate(() => document.querySelector('restir-viewer').viewer.reset().catch(({ code }) => code)), 'DEVICE');
    },
    destructible,
  ));

test('a device that fails before it says that it is lost is replaced as well', onlyChromium, () =>
  withElement(
    'src="builtin:cornell" technique="normals" max-samples="3"',
    async (page) => {
      await untilFrames(page, 3);
      await page.evaluate(() => {
        // It never says so.
        devices.at(-1).tell = () => new Promise(() => undefined);
        devices.at(-1).destroy();
        void document.querySelector('restir-viewer').viewer.reset();
      });
      assert.equal((await told(page, 'devicelost')).final, false);
      await told(page, 'restored');
      await untilFrames(page, 3);
      assert.equal(await page.evaluate(() => devices.length), 2);
    },
    destructible,
  ));

test('what is wrong with one attribute leaves the others; a message goes when another scene is there', () =>
  withElement('src="builtin:motion" technique="normals" max-samples="1" time="noon" params="nonsense" compare="technique=ris&seed=x" seed="7"', async (page) => {
    await untilFrames(page, 1);
    const all = [];
    for (let at = 0; at < 3; at++) all.push((await told(page, 'error')).message);
    for (const part of ['time=noon', 'nonsense', 'both pictures share it']) assert.ok(all.some((message) => message.includes(part)), `${part} in ${all}`);
    assert.deepEqual(await page.evaluate(() => {
      const { viewer, second } = document.querySelector('restir-viewer');
      return [viewer.settings.seed, viewer.settings.time, second.settings.technique];
    }), [7, 0, 'ris']);
    await page.evaluate(() => document.querySelector('restir-viewer').setAttribute('time', '1e10'));
    const words = () => page.evaluate(() => {
      const { hidden, textContent } = document.querySelector('restir-viewer').shadowRoot.querySelector('p');
      return hidden ? '' : textContent;
    });
    assert.match((await told(page, 'error')).message, /time=1e10/);
    assert.match(await words(), /time=1e10/);
    await page.evaluate(() => document.querySelector('restir-viewer').viewer.load('builtin:cornell'));
    assert.equal(await words(), '');
    await page.evaluate(() => document.querySelector('restir-viewer').viewer.load('builtin:motion'));
    await page.evaluate(() => document.querySelector('restir-viewer').viewer.load('missing.glb').catch(() => undefined));
    assert.match(await words(), /missing\.glb/);
    await page.evaluate(() => document.querySelector('restir-viewer').viewer.load('builtin:cornell'));
    await untilFrames(page, 1);
    assert.equal(await words(), '');
  }));

test('several viewers share one wasm module; labels, poster and pixels', () =>
  withHtml(
    `<!doctype html><style>restir-viewer { width: 64px; height: 48px; }</style>
    <restir-viewer src="cornell" technique="normals" scale="1" max-samples="1" alt="a box"></restir-viewer>
    <restir-viewer src="cornell" technique="normals" scale="1" max-samples="1" controls poster="restir/icon.svg"></restir-viewer>
    <script type="module" src="restir/element.js"></script>`,
    async (page) => {
      await page.waitForFunction(() => [...document.querySelectorAll('restir-viewer')].every(({ viewer }) => viewer?.scene), { polling: 50 });
      const [one, two] = await page.evaluate(() =>
        Promise.all(
          [...document.querySelectorAll('restir-viewer')].map(async (element) => {
            while ((await element.viewer.call((viewer) => viewer.frames())) < 1) await new Promise((resolve) => setTimeout(resolve, 50));
            const canvas = element.shadowRoot.querySelector('canvas');
            const { data, width } = await element.viewer.capture({ type: 'rgba' });
            const pixel = await element.viewer.readPixel(40, 30);
            const png = await createImageBitmap(await element.viewer.capture({ type: 'png' }));
            return {
              label: canvas.getAttribute('aria-label'), tab: canvas.tabIndex, poster: element.shadowRoot.querySelector('img').hidden,
              data: [...data], pixel, same: [...data.slice(4 * (30 * width + 40), 4 * (30 * width + 41))], png: [png.width, png.height],
              outside: await element.viewer.readPixel(64, 0).catch(({ code }) => code),
            };
          }),
        ),
      );
      assert.deepEqual([one.label, one.tab, two.label, two.tab], ['a box', -1, 'Rendered scene', 0]);
      assert.deepEqual(two.data, one.data);
      assert.deepEqual(one.pixel, one.same);
      assert.deepEqual([one.png, one.outside, one.poster, two.poster], [[64, 48], 'BAD_VALUE', true, true]);
      const fetched = await page.evaluate(() => performance.getEntriesByType('resource').filter(({ name }) => name.endsWith('restir_bg.wasm')).length);
      assert.equal(fetched, 1);
    },
  ));

const examples = [...readFileSync(join(root, 'docs', 'embedding.md'), 'utf8').matchAll(/^```html\n([\s\S]*?)^```$/gm)].map((match) => match[1]);

test('the examples of docs/embedding.md show what they say', async () => {
  const [three, attributes, events, viewerClass, ...rest] = examples;
  assert.equal(rest.length, 0);
  await withHtml(three, async (page) => {
    await untilFrames(page, 1);
    const sum = await page.evaluate(async () => (await document.querySelector('restir-viewer').viewer.capture({ type: 'rgba' })).data.reduce((a, b) => a + b, 0));
    assert.ok(sum > 0);
  });
  await withHtml(attributes, async (page) => {
    await untilFrames(page, 4);
    const said = await page.evaluate(() => document.querySelector('restir-viewer').shadowRoot.querySelector('p').innerText);
    assert.equal(said, '');
    assert.deepEqual(await picture(page), await pageDisplay('?scene=cornell&technique=path-tracer&seed=1&size=64x48&frames=4&render.max_depth=2&film.exposure=1', 4));
  });
  await withHtml(events, async (page) => {
    await page.waitForFunction(() => document.querySelector('img')?.naturalWidth > 0, { polling: 50 });
    assert.equal(await page.evaluate(() => document.getElementById('count').textContent), '2 frames');
  });
  await withHtml(viewerClass, async (page) => {
    await page.waitForFunction(() => document.body.dataset.link, { polling: 50 });
    const { pixel, link } = await page.evaluate(() => ({ ...document.body.dataset }));
    const rgb = await pageDisplay('?scene=cornell&technique=normals&size=64x48&frames=1', 1);
    assert.equal(pixel, [...rgb.subarray(3 * (24 * 64 + 32), 3 * (24 * 64 + 33)), 255].join());
    assert.equal(new URL(link).searchParams.get('film.exposure'), '2');
  });
});

test('the package installs in an empty folder, and its element shows a picture', async (context) => {
  const empty = join(folder, 'empty');
  mkdirSync(empty);
  const npm = (...words) => execFileSync('npm', words, { cwd: empty, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
  const [{ filename, size, unpackedSize, files }] = JSON.parse(npm('pack', root, '--json', '--ignore-scripts'));
  context.diagnostic(`${files.length} files, ${size} bytes packed, ${unpackedSize} unpacked`);
  npm('init', '--yes');
  npm('install', '--offline', '--no-audit', '--no-fund', `./${filename}`);
  const { exports } = JSON.parse(readFileSync(join(empty, 'node_modules', 'restir', 'package.json'), 'utf8'));
  const shipped = new Set(files.map(({ path }) => `./${path}`));
  for (const entry of Object.values(exports).flatMap((target) => Object.values(target))) assert.ok(shipped.has(entry), `${entry} is not in the package`);
  const element = exports['./element'].default.replace('./', 'empty/node_modules/restir/');
  await withHtml(
    `<!doctype html>\n<script type="module" src="${element}"></script>\n<restir-viewer src="cornell" technique="normals" scale="0.1"></restir-viewer>`,
    async (page) => {
      await untilFrames(page, 1);
      const values = await page.evaluate(async () => new Set((await document.querySelector('restir-viewer').viewer.capture({ type: 'rgba' })).data).size);
      assert.ok(values > 10, 'the picture is empty');
    },
  );
});
