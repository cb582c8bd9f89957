// The pixel inspector, a frame pass by pass, maps of difference, marks of bias, focus: with real clicks and keys.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { openSite, readDisplay, unfold, waitForFrames, withPage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Wide enough for what lies beside the picture: on a small screen it lies over it. */
const open = (query, work) =>
  withPage(site, query, async (page) => {
    await page.setViewport({ width: 1280, height: 800 });
    await work(page);
  });

const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const isHidden = (page, id) => page.$eval(`#${id}`, (element) => element.hidden);
/** Waits until the words of the inspector have all of `parts`. */
const inspectorSays = (page, ...parts) =>
  page.waitForFunction((wanted) => wanted.every((part) => document.getElementById('inspector').textContent.includes(part)), { polling: 50 }, parts);

/** The inspector's tables, as rows of numbers and words, and its marks in the picture: all of one reading, for the next may come between two questions. */
const reading = (page, stage) =>
  page.evaluate((joining) => {
    const value = (text) => (Number.isNaN(Number(text)) ? text : Number(text));
    const rows = (id) => [...document.querySelectorAll(`#inspector-${id} tbody tr`)].map((row) => [...row.cells].map(({ textContent }) => value(textContent)));
    const marks = (which) => document.querySelectorAll(`#marks ${which}`).length;
    return {
      passes: rows('reservoirs'),
      joined: rows(joining),
      circles: marks('circle.neighbour'),
      histories: marks('circle.history'),
      chosen: marks('line:is(.chosen, .shadowed)'),
    };
  }, stage);

test('a click on a pixel tells what the passes saw there, and the figures add up', () =>
  open('?scene=cornell&size=48x36&spatial_confidence_limit=1000&indirect=false', async (page) => {
    await page.click('#inspect');
    // The floor, left of the middle: 1280 by 800 shows 48 by 36 with bars left and right.
    await page.mouse.click(560, 660);
    await inspectorSays(page, 'was chosen', 'Of 32 candidates', 'neighbour', 'History');
    const where = (await text(page, 'inspector-where')).match(/\d+/g).map(Number);
    assert.deepEqual(where, [Math.floor((560 - (1280 - 800 * (48 / 36)) / 2) / (800 / 36)), Math.floor(660 / (800 / 36))]);
    const { passes, joined, circles, chosen } = await reading(page, 'spatial-1');
    assert.deepEqual(passes.map(([name]) => name), ['initial', 'temporal', 'spatial 1']);
    for (const [, , w, , target, estimate] of passes) assert.ok(Math.abs(w * target - estimate) <= 0.02 * estimate + 1e-3, `${w} * ${target} = ${estimate}`);
    // W = sum of w over p-hat of what was chosen: of the neighbours that joined.
    const [, , w, c, target] = passes[2];
    const sum = joined.reduce((total, row) => total + row[6], 0);
    assert.ok(Math.abs(w * target - sum) <= 0.03 * sum + 1e-3, `${w * target} and ${sum}`);
    const confidence = joined.reduce((total, row) => total + row[2], 0);
    assert.ok(Math.abs(c - confidence) <= 0.02 * confidence, `${c} and ${confidence}`);
    // As many circles as neighbours, and the chosen light is drawn, in colours that are not of the page's text.
    assert.equal(circles, joined.length - 1);
    assert.ok(chosen <= 1);
    // The next pixel by keys; the panel closes, and with it the marks.
    await page.focus('#canvas');
    await page.keyboard.down('Shift');
    await page.keyboard.press('ArrowRight');
    await page.keyboard.up('Shift');
    await page.waitForFunction((x) => document.getElementById('inspector-where').textContent.includes(String(x)), { polling: 50 }, where[0] + 1);
    await page.click('#inspector-close');
    assert.equal(await page.$$eval('#marks *', (all) => all.length), 0);
    assert.equal(await isHidden(page, 'inspector'), true);
  }));

for (const [technique, passes, stage] of [
  ['restir-di-decoupled', ['initial', 'temporal'], 'temporal'],
  ['restir-report', ['initial, 1', 'initial, 2', 'temporal, 1', 'temporal, 2', 'spatial 1, 1', 'spatial 1, 2'], 'temporal'],
]) {
  test(`${technique} says what it saw at a pixel`, () =>
    open(`?scene=cornell-64&size=48x36&accumulate=no&technique=${technique}&indirect=false`, async (page) => {
      await page.click('#inspect');
      await page.mouse.click(560, 660);
      await inspectorSays(page, 'was chosen', 'candidates', 'History joins: what pixel');
      const seen = await reading(page, stage);
      assert.deepEqual(seen.passes.map(([name]) => name), passes);
      for (const [, , w, , target, estimate] of seen.passes) assert.ok(Math.abs(w * target - estimate) <= 0.02 * estimate + 1e-3, `${w} * ${target} = ${estimate}`);
      assert.ok(seen.joined.length >= 2 && seen.joined[0][0] === 'this pixel', JSON.stringify(seen.joined));
      const sum = seen.joined.reduce((total, row) => total + row[6], 0);
      const [, , w, , target] = seen.passes.find(([name]) => name.startsWith(stage));
      assert.ok(Math.abs(w * target - sum) <= 0.03 * sum + 1e-3, `${w * target} and ${sum}`);
      assert.ok(seen.histories >= 1, 'the history is drawn');
    }));
}

test('a drag while inspecting still turns the camera, and chooses no pixel', () =>
  open('?scene=cornell&size=24x18&technique=ris', async (page) => {
    await page.click('#inspect');
    await inspectorSays(page, 'Pixel 12, 9');
    await page.mouse.move(600, 400);
    await page.mouse.down();
    await page.mouse.move(660, 400, { steps: 3 });
    await page.mouse.up();
    await page.waitForFunction(() => location.search.includes('pose='), { polling: 50 });
    assert.equal(await text(page, 'inspector-where'), 'Pixel 12, 9');
  }));

test('why: the background has no surface, the light shines itself', () =>
  open('?scene=veach-mis&size=40x30&technique=normals', async (page) => {
    const pixels = await page.evaluate(async () => {
      const found = {};
      for (let y = 0; y < 30; y += 3) {
        for (let x = 0; x < 40; x += 3) {
          const seen = await window.restir.call(async (viewer) => {
            viewer.inspect(Uint32Array.of(x, y));
            viewer.begin();
            viewer.finish();
            return JSON.parse(await viewer.inspection());
          });
          if (!seen.surface) found.background ??= seen;
          else if (seen.surface.emission[0] > 0) found.light ??= seen;
          if (found.background && found.light) return found;
        }
      }
      return found;
    });
    const words = (seen) => page.evaluate(async (given) => (await import(new URL('explain-pixel.js', location.href).href)).explainPixel(given), seen);
    assert.ok(pixels.light, 'a light is in the picture');
    assert.match((await words(pixels.light))[0], /shines itself/);
    if (pixels.background) assert.match((await words(pixels.background))[0], /background/);
  }));

test('a frame pass by pass: pictures, equations and sources of each', () =>
  open('?scene=cornell&size=32x24&spatial_confidence_limit=1000', async (page) => {
    await page.focus('#canvas');
    await page.keyboard.press('t');
    await page.waitForSelector('#steps:not([hidden])');
    const names = await page.$$eval('#steps-passes button', (all) => all.map(({ textContent }) => textContent));
    assert.equal(names[0], 'scene/visibility');
    assert.ok(names.includes('restir-di/spatial') && names.at(-1) === 'film/display', names.join());
    const picture = () => page.$eval('#passed', (canvas) => [...canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data].filter((_, at) => at % 4 < 3));
    const seen = new Set();
    for (const name of names) {
      await page.waitForFunction((wanted) => document.getElementById('steps-words').textContent.includes(`, ${wanted}.`), { polling: 50 }, name);
      await page.waitForFunction(() => document.getElementById('steps-source').textContent.includes('One invocation'), { polling: 50 });
      seen.add((await picture()).join());
      if (name !== names.at(-1)) await page.click('#steps-on');
    }
    assert.equal(seen.size, names.length - 1, 'each pass but the one that adds up shows another picture');
    assert.deepEqual(Uint8Array.from(await picture()), await readDisplay(page), 'the last is what is displayed');
    // An included file, and back.
    await page.$$eval('#steps-passes button', (all) => all.find(({ textContent }) => textContent === 'restir-di/spatial').click());
    assert.match(await page.$eval('#steps-equations', (element) => element.textContent), /W/);
    await page.waitForFunction(() => [...document.querySelectorAll('#steps-includes button')].some(({ textContent }) => textContent.endsWith('spatial_reuse.wgsl')), { polling: 50 });
    await page.$$eval('#steps-includes button', (all) => all.find(({ textContent }) => textContent.endsWith('spatial_reuse.wgsl')).click());
    await page.waitForFunction(() => document.getElementById('steps-source').textContent.includes('fn reuse_pixel'), { polling: 50 });
    // Another frame, another noise; whatever changes the picture ends it.
    await page.click('#steps-frame');
    await page.waitForFunction(() => document.getElementById('steps-words').textContent.includes('scene/visibility'), { polling: 50 });
    await page.select('#view', 'albedo');
    await page.waitForFunction(() => document.getElementById('steps').hidden && document.getElementById('passed').hidden, { polling: 50 });
  }));

test('a picture of one pixel is taken apart as well, and ends when frames go on', () =>
  open('?scene=cornell&size=1x1&technique=normals', async (page) => {
    await page.focus('#canvas');
    await page.keyboard.press('t');
    await page.waitForSelector('#steps:not([hidden])');
    assert.deepEqual(await page.$eval('#passed', ({ width, height }) => [width, height]), [1, 1]);
    // There is room for one panel.
    await page.keyboard.press('i');
    await page.waitForFunction(() => document.getElementById('steps').hidden && !document.getElementById('inspector').hidden, { polling: 50 });
    await page.keyboard.press('t');
    await page.waitForFunction(() => document.getElementById('inspector').hidden && !document.getElementById('steps').hidden, { polling: 50 });
    await page.keyboard.press(' ');
    await page.waitForFunction(() => document.getElementById('steps').hidden, { polling: 50 });
    assert.equal(await page.$eval('#message', ({ hidden }) => hidden), true);
  }));

test('a frame is taken apart while a scene loads: its first one', () =>
  open('?scene=cornell&size=16x12&technique=normals', async (page) => {
    await waitForFrames(page, 1);
    await page.select('#scene', 'veach-mis');
    await page.click('#dissect');
    await page.waitForSelector('#steps:not([hidden])');
    await page.waitForFunction(() => location.search.includes('scene=veach-mis') && document.getElementById('loading').hidden, { polling: 50 });
    assert.equal(await page.$eval('#pause', (button) => button.getAttribute('aria-pressed')), 'true');
    assert.equal(await page.$eval('#message', ({ hidden }) => hidden), true);
  }));

test('maps of difference: against the reference, and against picture B', () =>
  open('?scene=cornell&size=32x24&technique=path-tracer&render.max_depth=1&frames=4', async (page) => {
    await waitForFrames(page, 4);
    await unfold(page, 'errors');
    await page.select('#difference', 'flip');
    await page.waitForFunction(() => document.getElementById('difference-words').textContent.includes('Keep a reference'), { polling: 50 });
    await page.click('#keep-reference');
    // The same frames again: no difference at all in the end.
    await page.waitForFunction(() => /FLIP against the reference: mean 0\.0000/.test(document.getElementById('difference-words').textContent), { polling: 100 });
    const map = () => page.$eval('#map', (canvas) => [...canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data]);
    const black = await map();
    assert.ok(black.every((value, at) => at % 4 === 3 || value <= 4), 'magma begins with black');
    // Twice as bright is brighter everywhere: red.
    await page.select('#difference', 'signed');
    await page.select('#technique', 'normals');
    await page.waitForFunction(
      () => {
        const canvas = document.getElementById('map');
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        return data.some((value, at) => at % 4 === 0 && value > 100) && document.getElementById('difference-words').textContent.includes('brighter');
      },
      { polling: 100 },
    );
    await page.select('#difference', '');
    await page.waitForFunction(() => document.getElementById('map').hidden, { polling: 50 });
  }));

test('settings that bias are marked as they are set, contradictions with others included', () =>
  open('?scene=cornell&size=24x16&frames=2', async (page) => {
    const biased = () => page.$$eval('.parameter .bias:not([hidden])', (all) => all.map((mark) => mark.closest('.parameter').dataset.key).sort());
    const becomes = async (...wanted) => {
      await page.waitForFunction((keys) => [...document.querySelectorAll('.parameter .bias:not([hidden])')].map((mark) => mark.closest('.parameter').dataset.key).sort().join() === keys, { polling: 50 }, wanted.sort().join());
    };
    await becomes('render.max_depth', 'render.texture_levels');
    await page.select('#parameter-reuse_weights', 'heuristics');
    await becomes('render.max_depth', 'render.texture_levels', 'reuse_weights');
    await page.select('#parameter-reuse_weights', 'balance');
    await page.click('#parameter-visibility_in_weights');
    await becomes('render.max_depth', 'render.texture_levels', 'visibility_in_weights');
    await page.click('#parameter-visibility_reuse');
    await becomes('render.max_depth', 'render.texture_levels');
    assert.equal((await biased()).length, 2);
  }));

test('a double click turns the camera to what is there, which it then orbits', () =>
  open('?scene=cornell&size=40x40&technique=normals&render.pixel_filter=center', async (page) => {
    const [x, y] = [500, 520];
    const expected = await page.evaluate(async (px, py) => {
      return window.restir.call(async (viewer) => {
        viewer.inspect(Uint32Array.of(px, py));
        viewer.begin();
        viewer.finish();
        return JSON.parse(await viewer.inspection()).surface.position;
      });
    }, Math.floor((x - 240) / 20), Math.floor(y / 20));
    await page.mouse.click(x, y, { count: 2 });
    await page.waitForFunction(() => location.search.includes('pose='), { polling: 50 });
    const { position, forward } = await page.evaluate(() => window.restir.call((viewer) => JSON.parse(viewer.camera())));
    const to = expected.map((value, at) => value - position[at]);
    const length = Math.hypot(...to);
    const cosine = to.reduce((sum, value, at) => sum + (value / length) * forward[at], 0);
    assert.ok(cosine > 0.99999, `looks at the point: ${cosine}`);
  }));

test('viewers of a page share one device', () =>
  open('?scene=cornell&size=24x16&frames=2', async (page) => {
    await page.evaluate(() => {
      window.devices = 0;
      const { requestDevice } = GPUAdapter.prototype;
      GPUAdapter.prototype.requestDevice = function (...words) {
        window.devices += 1;
        return requestDevice.apply(this, words);
      };
    });
    await page.click('#compare');
    await page.waitForFunction(async () => (await window.restir.other((viewer) => viewer.frames())) >= 2, { polling: 100 });
    assert.equal(await page.evaluate(() => window.devices), 0, 'picture B asked for no other');
  }));
