// A load is told stage by stage, its download byte by byte, its pipelines one by one, until the first picture.
import { strict as assert } from 'node:assert';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite, waitForFrames, waitForMessage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

const all = ['Download', 'Parse', 'BVH', 'Textures and lights', 'Pipelines', 'First picture'];

/** Keeps each state of the loading bar. */
const watch = () => {
  window.seen = [];
  document.addEventListener('DOMContentLoaded', () => {
    const loading = document.getElementById('loading');
    const look = () => {
      const [, current, count] = /^(.*?)(?: (\d+ of \d+))?$/.exec([...loading.querySelectorAll('[aria-current=step]')].map((item) => item.textContent).join());
      const state = {
        current,
        count,
        done: loading.querySelectorAll('.done').length,
        text: document.getElementById('loading-text').textContent,
        value: document.getElementById('loading-bar').value,
        hidden: loading.hidden,
        pictures: performance.getEntriesByName('picture').length,
      };
      if (JSON.stringify(seen.at(-1)) !== JSON.stringify(state)) seen.push(state);
    };
    look();
    new MutationObserver(look).observe(loading, { subtree: true, childList: true, attributes: true, characterData: true });
  });
};

const seen = (page) => page.evaluate(() => window.seen);
const without = (list) => list.filter((text, at) => text !== '' && text !== list[at - 1]);

/** Pipelines are counted from 0 up to those there are, in their stage; returns the counts. */
function assertCounts(states, all) {
  assert.ok(states.every(({ count, current }) => !count || current === 'Pipelines'));
  const counts = without(states.map(({ count = '' }) => count)).map((text) => text.split(' of ').map(Number));
  assert.ok(counts.every(([, of]) => of === all), counts.join('; '));
  const made = counts.map(([each]) => each);
  assert.deepEqual(made, [...new Set(made)].sort((a, b) => a - b));
  assert.ok(made[0] === 0 && made.at(-1) < all, made.join());
  return made;
}

test('a built-in scene goes through its stages in order; the last ends with the first picture', async () => {
  const { page, problems } = await openPage(site, '?scene=cornell&technique=normals&size=24x16&frames=1', watch);
  try {
    await waitForFrames(page, 1);
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    const states = await seen(page);
    assert.deepEqual(without(states.map(({ current }) => current)), all);
    for (const { current, done } of states) if (current) assert.equal(done, all.indexOf(current));
    // Primary rays, normals, film, display. Several may be compiled at a time; the last of them begins the next stage.
    assertCounts(states, 4);
    const picture = states.filter(({ current, hidden }) => current === 'First picture' && !hidden);
    assert.ok(picture.length > 0 && picture.every(({ pictures }) => pictures === 0), 'before the first picture the bar is there');
    assert.ok(states.at(-1).hidden && states.at(-1).pictures >= 1, 'and not after it');

    // Another scene on the same page: again to the end.
    await page.evaluate(() => (window.seen = []));
    await page.select('#scene', 'furnace');
    await page.waitForFunction(() => window.seen.at(-1)?.hidden && window.seen.some(({ current }) => current === 'First picture'), { polling: 50 });
    assert.deepEqual(without((await seen(page)).map(({ current }) => current)), all);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
});

test('pipelines are counted as the device compiles them', async (context) => {
  const { page, problems } = await openPage(site, '?scene=cornell&technique=restir-di&size=24x16&frames=1', watch);
  await waitForFrames(page, 1);
  // Primary rays, candidates, spatial reuse, indirect light, shading, film, display.
  const made = assertCounts(await seen(page), 7);
  context.diagnostic(`told at ${made.join(', ')} of 7`);
  assert.ok(made.length > 1);
  assertNoProblems(problems);
  await page.close();
});

/** Serves a triangle whose buffer comes in pieces, slowly. */
async function slowServer(bytes) {
  const positions = new Float32Array(bytes / 4);
  positions.set([0, 0, 0, 1, 0, 0, 0, 1, 0]);
  const buffer = Buffer.from(positions.buffer);
  const gltf = JSON.stringify({
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    buffers: [{ byteLength: bytes, uri: 'slow.bin' }], bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
  });
  const server = createServer(async (request, response) => {
    const body = request.url.endsWith('.bin') ? buffer : Buffer.from(gltf);
    response.writeHead(200, { 'access-control-allow-origin': '*', 'content-length': body.length });
    const pieces = body.length > 10_000 ? 8 : 1;
    for (let at = 0; at < pieces; at++) {
      response.write(body.subarray((at * body.length) / pieces, ((at + 1) * body.length) / pieces));
      await new Promise((resolve) => setTimeout(resolve, 300));
    }
    response.end();
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const close = () => new Promise((done) => (server.close(done), server.closeAllConnections()));
  return { url: `http://localhost:${server.address().port}/triangle.gltf`, close };
}

test('a download is told in bytes of all bytes, and can be cancelled', async () => {
  const server = await slowServer(4_000_000);
  const { page } = await openPage(site, `?scene=${encodeURIComponent(server.url)}&technique=normals&size=24x16&frames=1`, watch);
  try {
    await waitForFrames(page, 1);
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    const states = await seen(page);
    assert.deepEqual(without(states.map(({ current }) => current)), all);
    const told = states.map(({ text, value }) => ({ found: /^Loading triangle\.gltf: ([\d.]+) (?:KB|MB) of 4\.0 MB$/.exec(text), value })).filter(({ found }) => found);
    assert.ok(told.length >= 4, `told ${told.length} times: ${states.map(({ text }) => text).join('; ')}`);
    const values = told.map(({ value }) => value);
    assert.deepEqual(values, [...values].sort((a, b) => a - b));
    assert.ok(values.at(-1) <= 0.5 && values.at(-1) > 0.2, 'the download is the first half');

    await page.select('#scene', 'cornell');
    await page.waitForFunction(() => document.getElementById('loading').hidden && !location.search.includes('gltf'), { polling: 50 });
    await page.evaluate(() => {
      window.seen = [];
      history.back();
    });
    await page.waitForFunction(() => window.seen.some(({ text }) => / of 4\.0 MB/.test(text)), { polling: 20 });
    await page.click('#cancel');
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    // The address is again that of what is shown.
    await page.waitForFunction(() => !location.search.includes('gltf'), { polling: 50 });
  } finally {
    await page.close();
    await server.close();
  }
});

test('a load that fails leaves no bar', async () => {
  const { page } = await openPage(site, '?scene=cornell&technique=normals&size=24x16&frames=1', watch);
  await waitForFrames(page, 1);
  await page.evaluate(() => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File(['nonsense'], 'broken.glb'));
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
  });
  assert.match(await waitForMessage(page), /broken\.glb/);
  await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
  await page.close();
});
