// Frames in time: the scale that keeps a budget, by simulated frames and on the page.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite, waitForFrames } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

async function frameBudget(milliseconds, start = 1) {
  const { FrameBudget } = await import(new URL('../../dist/frame-budget.js', import.meta.url));
  const budget = new FrameBudget();
  budget.milliseconds = milliseconds;
  budget.startAt(start);
  return budget;
}

/** Gives `count` frames to the controller, each as long as `cost` says of its scale; returns the scales. */
function play(budget, count, cost, inMotion = false) {
  return Array.from({ length: count }, (_, at) => {
    const scale = budget.scale(inMotion);
    budget.observe(cost(scale, at), inMotion);
    return scale;
  });
}

/** Some time of its own, some for each pixel, and noise between -15 and 15 %. */
const frames = (fixed, full) => (scale, at) => (fixed + full * scale ** 2) * (1 + 0.15 * Math.sin(at * 12.9898));
const changes = (scales) => scales.filter((scale, at) => at > 0 && scale !== scales[at - 1]).length;

for (const milliseconds of [16, 33, 100, 250]) {
  test(`at rest, frames come to keep ${milliseconds} ms from above and from below, and the scale comes to rest`, async () => {
    for (const start of [1, 0.25]) {
      const cost = frames(2, 4 * milliseconds);
      const budget = await frameBudget(milliseconds, start);
      const scales = play(budget, 400, cost);
      const end = scales.at(-1);
      assert.ok(2 + 4 * milliseconds * end ** 2 <= 1.05 * milliseconds, `from ${start}: scale ${end}`);
      assert.ok(end > 0.35, `from ${start}: there is room at ${end}`);
      assert.ok(changes(scales.slice(100)) <= 2, `from ${start}: it hunts: ${[...new Set(scales.slice(100))]}`);
    }
  });
}

test('one slow frame is no reason; a scene that becomes light is rendered in full again', async () => {
  const budget = await frameBudget(33);
  assert.deepEqual(new Set(play(budget, 40, (_, at) => (at % 10 === 0 ? 500 : 20))), new Set([1]));
  play(budget, 40, frames(1, 200));
  assert.ok(budget.scale(false) < 0.5);
  play(budget, 200, frames(1, 10));
  assert.equal(budget.scale(false), 1);
});

test('where a rise is always taken back, it is tried ever less often', async () => {
  // A step that no model of pixels foresees.
  const cost = (scale) => (scale > 0.5 ? 60 : 5);
  const budget = await frameBudget(33, 0.5);
  const scales = play(budget, 2000, cost);
  assert.ok(changes(scales.slice(0, 200)) > changes(scales.slice(1800)), 'it goes on hunting');
  assert.ok(changes(scales.slice(1000)) <= 6);
});

test('in motion the scale falls at once, and the scale at rest stays', async () => {
  const budget = await frameBudget(33, 0.25);
  // Slow even at the least scale at rest.
  const cost = frames(3, 1600);
  play(budget, 10, cost);
  assert.equal(budget.scale(false), 0.25);
  const moving = play(budget, 30, cost, true);
  assert.ok(moving[0] < 0.2 && moving[0] >= 0.1, `the first frame in motion: ${moving[0]}`);
  assert.ok(moving.slice(3).every((scale) => cost(scale, 0) <= 33 * 1.05), `${moving}`);
  assert.equal(budget.scale(false), 0.25);
  // Fast frames need no preview.
  const light = await frameBudget(33);
  play(light, 20, frames(1, 10));
  assert.equal(light.scale(true), 1);
});

/** The size in the status line. */
const width = (page) => page.$eval('#status', (status) => Number(/(\d+)×/.exec(status.textContent)?.[1]));

test('on the page: coarse while the camera moves, the sharp picture comes through it, and a fixed scale stays', async () => {
  const { page, problems } = await openPage(site, '?scene=cornell&technique=normals&budget=1', () => {
    // What lies over the canvas, and how it ends.
    window.overlays = [];
    new MutationObserver((records) => {
      for (const node of records.flatMap(({ addedNodes }) => [...addedNodes])) {
        if (!(node instanceof HTMLCanvasElement) || node.id) continue;
        const { data } = node.getContext('2d').getImageData(0, 0, node.width, node.height);
        overlays.push({ width: node.width, colours: new Set(data).size });
      }
    }).observe(document, { subtree: true, childList: true });
  });
  try {
    await page.emulateMediaFeatures?.([{ name: 'prefers-reduced-motion', value: 'no-preference' }]).catch(() => undefined);
    await waitForFrames(page, 6);
    const still = await width(page);
    assert.equal(still, 160, 'a quarter a side');
    await page.mouse.move(100, 200);
    await page.mouse.down();
    let coarse = still;
    for (let step = 1; step < 40 && coarse >= still; step++) {
      await page.mouse.move(100 + 2 * step, 200);
      await new Promise((resolve) => setTimeout(resolve, 30));
      coarse = await width(page);
    }
    await page.mouse.up();
    assert.ok(coarse < still, `${coarse} pixels in motion`);
    await page.waitForFunction((sharp) => document.getElementById('status').textContent.includes(`${sharp}×`), { polling: 20 }, still);
    await page.waitForFunction(() => document.querySelectorAll('main canvas:not([id])').length === 0, { polling: 50 });
    const overlays = await page.evaluate(() => overlays);
    assert.ok(overlays.length >= 1 && overlays.every((overlay) => overlay.width < still && overlay.colours > 10), JSON.stringify(overlays));

    // The menu, the address, and a scale that is fixed.
    await page.select('#budget', '250');
    await page.waitForFunction(() => location.search.includes('budget=250'), { polling: 50 });
    // So much that the busiest machine has room.
    await page.$eval('#budget', (menu) => {
      menu.append(new Option('10 s', '10000', true, true));
      menu.dispatchEvent(new Event('change'));
    });
    await page.waitForFunction((before) => Number(/(\d+)×/.exec(document.getElementById('status').textContent)?.[1]) > before, { polling: 50 }, still);
    await page.select('#scale', '0.25');
    await page.waitForFunction(() => document.getElementById('budget').disabled && document.getElementById('status').textContent.includes('160×'), { polling: 50 });
    const count = await page.evaluate(() => overlays.length);
    await page.mouse.move(100, 200);
    await page.mouse.down();
    await page.mouse.move(160, 210, { steps: 4 });
    await page.mouse.up();
    await waitForFrames(page, 2);
    assert.deepEqual([await width(page), await page.evaluate(() => overlays.length)], [160, count]);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
});
