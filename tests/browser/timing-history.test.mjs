// The history of readings in the list of passes.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite, unfold, waitForFrames } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

test('passes that come and go are layers, and a device that measures none has one', async () => {
  const { layersOf } = await import(new URL('../../dist/readings.js', import.meta.url));
  const reading = (milliseconds, passes) => ({ milliseconds, rays: 1, passes: Object.entries(passes).map(([name, ms]) => ({ name, ms })) });
  assert.deepEqual(layersOf([reading(9, { a: 1, b: 2 }), reading(9, { b: 3, c: 4 }), reading(9, {})]), [
    { name: 'a', values: [1, 0, 0] },
    { name: 'b', values: [2, 3, 0] },
    { name: 'c', values: [0, 4, 0] },
  ]);
  assert.deepEqual(layersOf([reading(9, {}), reading(7, {})]), [{ name: 'frame', values: [9, 7] }]);
});

test('readings are drawn, and told under the pointer and by keys', async () => {
  const { page, problems } = await openPage(site, '?scene=cornell&technique=path-tracer&size=48x32');
  try {
    await page.setViewport({ width: 800, height: 600 });
    await waitForFrames(page, 3);
    await unfold(page, 'timing');
    const most = () => page.$eval('#pass-history svg', (chart) => Number(chart.getAttribute('aria-valuemax')));
    const words = () => page.$eval('#pass-history figcaption', (caption) => caption.textContent);
    await page.waitForFunction(() => Number(document.querySelector('#pass-history svg').getAttribute('aria-valuemax')) >= 4, { polling: 50 });
    assert.match(await words(), /^Last reading: [\d.]+ ms a frame, [\d.]+ [kMG]?rays\/s/);

    // The areas are as high as the readings: the highest touches the top.
    const tops = await page.$$eval('#pass-history polygon', (all) => all.flatMap((area) => area.getAttribute('points').split(' ').map((point) => Number(point.split(',')[1]))));
    assert.ok(Math.min(...tops) < 0.1 && Math.max(...tops) > 89, `from ${Math.min(...tops)} to ${Math.max(...tops)}`);
    const passes = await page.evaluate(async () => JSON.parse(await window.restir.call((viewer) => viewer.stats())).passes.length);
    assert.ok((await page.$$('#pass-history polygon')).length >= Math.max(1, passes));

    // No reading comes between a key and its words.
    await page.click('#pause');
    await page.waitForFunction(
      () => {
        const before = window.lastReadings;
        window.lastReadings = document.querySelector('#pass-history svg').getAttribute('aria-valuemax');
        return before === window.lastReadings;
      },
      { polling: 700 },
    );
    await page.evaluate(() => document.querySelector('#pass-history svg').focus());
    await page.keyboard.press('ArrowLeft');
    assert.match(await words(), /^1 reading before: /);
    await page.keyboard.press('Home');
    assert.match(await page.$eval('#pass-history svg', (chart) => chart.getAttribute('aria-valuetext')), /^\d+ readings before: .*rays\/s/);
    assert.equal(await page.$eval('#pass-history .cursor', (line) => line.getAttribute('visibility')), 'visible');
    await page.keyboard.press('End');
    const box = await (await page.$('#pass-history svg')).boundingBox();
    await page.mouse.move(box.x + 2, box.y + 20);
    const before = await most();
    assert.ok(before >= 4);
    assert.match(await words(), /readings? before/);
    await page.mouse.move(box.x + box.width - 1, box.y + 20);
    assert.match(await words(), /^(Last reading|1 reading before)/);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
});
