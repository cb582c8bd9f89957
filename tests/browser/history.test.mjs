// Back and Forward: each choice is a step, and a step back shows the former picture without loading the page again.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite, readDisplay, waitForFrames } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

async function withPage(query, work) {
  const { page, problems } = await openPage(site, query);
  try {
    await waitForFrames(page, 2);
    await page.evaluate(() => (window.samePage = true));
    await work(page);
    assert.ok(await page.evaluate(() => window.samePage), 'the page was not loaded again');
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
}

const addressIs = (page, test) =>
  page.waitForFunction((text) => new RegExp(text).test(location.search) && document.getElementById('loading').hidden, { polling: 50 }, test.source);

/** The picture of the first two frames, as a link shows it, once the address is as it should be. */
async function pictureAt(page, test) {
  await addressIs(page, test);
  return firstFrames(page);
}

async function firstFrames(page) {
  const drawn = await page.evaluate(async () => {
    // After all that has been asked for.
    await window.restir.call(() => undefined);
    document.getElementById('reset').click();
    return performance.getEntriesByName('picture').length;
  });
  await page.waitForFunction((before) => performance.getEntriesByName('picture').length >= before + 2, { polling: 50 }, drawn);
  await waitForFrames(page, 2);
  return readDisplay(page);
}

const value = (page, id) => page.$eval(`[id="${id}"]`, (element) => element.value);
const steps = (page) => page.evaluate(() => history.length);

test('a step back shows the former scene, technique, view and settings, and forward those after', () =>
  withPage('?scene=cornell&technique=path-tracer&size=24x16&frames=2&render.max_depth=1&seed=3', async (page) => {
    const first = await pictureAt(page, /max_depth=1/);
    const begin = await steps(page);

    // What slides is part of the step that is shown.
    await page.$eval('[id="parameter-film.exposure"]', (input) => {
      for (const text of ['1', '2', '3']) {
        input.value = text;
        input.dispatchEvent(new Event('change'));
      }
    });
    const bright = await pictureAt(page, /exposure=3/);
    assert.notDeepEqual(bright, first);
    assert.equal(await steps(page), begin);

    await page.select('#technique', 'ris');
    const reused = await pictureAt(page, /technique=ris/);
    await page.select('#view', 'normal');
    const normals = await pictureAt(page, /view=normal/);
    await page.select('#scene', 'furnace');
    const furnace = await pictureAt(page, /scene=furnace/);
    assert.equal(await steps(page), begin + 3);

    await page.evaluate(() => history.back());
    assert.deepEqual(await pictureAt(page, /^(?!.*scene=).*view=normal/), normals);
    assert.equal(await value(page, 'scene'), 'cornell');
    await page.evaluate(() => history.back());
    assert.deepEqual(await pictureAt(page, /^(?!.*view=)/), reused);
    await page.evaluate(() => history.back());
    assert.deepEqual(await pictureAt(page, /technique=path-tracer.*exposure=3/), bright);
    assert.equal(await value(page, 'technique'), 'path-tracer');
    assert.equal(await value(page, 'parameter-film.exposure'), '3');
    assert.equal(await value(page, 'parameter-render.max_depth'), '1');

    // Twice at once: what the first step began is given up.
    await page.evaluate(() => history.go(2));
    assert.deepEqual(await pictureAt(page, /view=normal/), normals);
    await page.evaluate(() => {
      history.forward();
      setTimeout(() => history.go(-3), 30);
    });
    assert.deepEqual(await pictureAt(page, /technique=path-tracer.*exposure=3/), bright);
    await page.evaluate(() => history.go(3));
    assert.deepEqual(await pictureAt(page, /scene=furnace/), furnace);
  }));

test('the camera is where it was when the step was left', () =>
  withPage('?scene=cornell&technique=normals&size=24x16&frames=2&render.pixel_filter=center', async (page) => {
    const begin = await steps(page);
    await page.mouse.move(100, 200);
    await page.mouse.down();
    await page.mouse.move(150, 210, { steps: 4 });
    await page.mouse.up();
    const moved = await pictureAt(page, /pose=/);
    assert.equal(await steps(page), begin);
    await page.select('#technique', 'ris');
    await pictureAt(page, /technique=ris/);
    await page.focus('#canvas');
    const old = await page.evaluate(() => location.search);
    await page.keyboard.press('ArrowLeft', { delay: 300 });
    await page.waitForFunction((before) => location.search !== before, { polling: 50 }, old);
    await page.goBack();
    const back = await pictureAt(page, /technique=normals/);
    // The address keeps five digits of each number.
    const close = back.filter((byte, at) => Math.abs(byte - moved[at]) <= 2).length;
    assert.ok(close / back.length > 0.97, `${close} of ${back.length} values are as before`);
    await page.goForward();
    await addressIs(page, /technique=ris.*pose=/);
  }));

test('opening and closing the comparison are steps, and its settings come back', () =>
  withPage('?scene=cornell&technique=normals&size=24x16&frames=2', async (page) => {
    const label = (text) => page.waitForFunction((wanted) => document.getElementById('label-b')?.textContent.includes(wanted), { polling: 50 }, text);
    const closed = () => page.waitForFunction(() => !document.getElementById('canvas-b'), { polling: 50 });
    await page.click('#compare');
    await label('normals, 2 frames');
    await page.select('#technique', 'ris');
    await label('ris, 2 frames');
    await addressIs(page, /b=technique%3Dris|b=technique=ris/);
    await page.click('#compare');
    await closed();
    await page.evaluate(() => history.back());
    await label('ris, 2 frames');
    await page.evaluate(() => history.back());
    await label('normals, 2 frames');
    await page.evaluate(() => history.back());
    await closed();
    assert.equal(await page.$eval('#compare', (button) => button.ariaPressed), 'false');
    await page.evaluate(() => history.go(2));
    await label('ris, 2 frames');
  }));

test("a file of the user's is shown again, and what cannot be read in an address is a warning", () =>
  withPage('?scene=cornell&technique=normals&size=24x16&frames=2', async (page) => {
    const first = await firstFrames(page);
    const positions = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer).toString('base64');
    const triangle = {
      asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
      buffers: [{ byteLength: 36, uri: `data:application/octet-stream;base64,${positions}` }], bufferViews: [{ buffer: 0, byteLength: 36 }],
      accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
    };
    await page.evaluate((text) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([text], 'triangle.gltf'));
      document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    }, JSON.stringify(triangle));
    const sceneIs = (name) => page.waitForFunction((wanted) => document.getElementById('scene').value === wanted && document.getElementById('loading').hidden, { polling: 50 }, name);
    await sceneIs('triangle.gltf');
    const dropped = await firstFrames(page);
    await page.evaluate(() => history.back());
    await sceneIs('cornell');
    assert.deepEqual(await firstFrames(page), first);
    await page.evaluate(() => history.forward());
    await sceneIs('triangle.gltf');
    assert.deepEqual(await firstFrames(page), dropped);

    await page.evaluate(() => {
      history.pushState(null, '', '?technique=normals&size=24x16&frames=2&candidatez=3&view=bogus');
      history.pushState(null, '', '?technique=ris&size=24x16&frames=2');
      history.back();
    });
    await page.waitForFunction(() => /candidatez/.test(document.getElementById('warnings').textContent), { polling: 50 });
    assert.match(await page.$eval('#warnings', (warnings) => warnings.textContent), /bogus/);
    assert.deepEqual(await firstFrames(page), first);
  }));
