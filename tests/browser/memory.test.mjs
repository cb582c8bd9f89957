// The figures of memory: what the popover says, and that they follow the size of the picture.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { openSite, unfold, waitForFrames, withPage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Bytes a pixel: radiance, sum and count, display, two visibility buffers, three pictures of first surfaces. */
const film = 16 + 16 + 4 + 2 * 16 + 3 * 16;
/** Three buffers of reservoirs of one sample, and indirect light. */
const technique = 3 * 16 + 16;

const held = (page) => page.evaluate(async () => JSON.parse(await window.restir.call((viewer) => viewer.stats())).memory);
const told = async (page, pattern) => {
  const handle = await page.waitForFunction((source) => new RegExp(source).exec(document.getElementById('memory').textContent), { polling: 50 }, pattern);
  return (await handle.jsonValue()).slice(1).map(Number);
};

test('memory grows by what the pixels take, and shrinks again', () =>
  withPage(site, '?scene=cornell&technique=restir-di&size=64x48', async (page) => {
    assert.ok(await page.$eval('#memory', (words) => words.hidden));
    await unfold(page, 'timing');
    const [all, scene] = await told(page, String.raw`^GPU ([\d.]+) MB \(scene ([\d.]+), film ([\d.]+), technique ([\d.]+)\), WebAssembly ([\d.]+) MB`);
    assert.ok(all > 0.3 && all >= scene, `${all} MB, the scene ${scene} MB`);
    const small = await held(page);
    const resize = (width, height) => page.evaluate((sides) => window.restir.call((viewer) => viewer.resize(...sides)), [width, height]);

    await resize(320, 240);
    const large = await held(page);
    const pixels = 320 * 240 - 64 * 48;
    assert.equal(large.film - small.film, pixels * film);
    assert.equal(large.technique - small.technique, pixels * technique);
    await resize(64, 48);
    assert.deepEqual({ ...(await held(page)), wasm: 0 }, { ...small, wasm: 0 });
    assert.ok(small.wasm >= 1 << 20 && small.wasm % 65_536 === 0, `${small.wasm} bytes of WebAssembly`);

    // What is inspected is told, and another scene's memory is its own.
    await page.evaluate(() => window.restir.call((viewer) => viewer.inspect(Uint32Array.of(3, 3))));
    await told(page, String.raw`inspector ([\d.]+)\)`);
    await page.select('#scene', 'glossy-spheres');
    await waitForFrames(page, 1);
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    assert.ok((await held(page)).scene > small.scene);
  }));
