// Views that are kept: chosen like cameras, renamed, deleted, reached by number keys, and there after the page is opened again.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite, readDisplay, waitForFrames } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

const query = '?scene=cornell&technique=normals&size=24x16&frames=1&render.pixel_filter=center';
const entries = (page) => page.$$eval('#camera option:not([hidden])', (options) => options.map(({ textContent }) => textContent));
const chosen = (page, text) =>
  page.waitForFunction((wanted) => document.getElementById('camera').selectedOptions[0]?.textContent === wanted, { polling: 50 }, text);

async function drag(page, x, y) {
  await page.mouse.move(100, 200);
  await page.mouse.down();
  await page.mouse.move(100 + x, 200 + y, { steps: 3 });
  await page.mouse.up();
  await chosen(page, 'moved');
  // The last step of the drag may come frames after the first.
  await page.waitForFunction(
    async () => {
      const camera = await window.restir.call((viewer) => viewer.camera());
      const rests = camera === window.lastCamera;
      window.lastCamera = camera;
      return rests;
    },
    { polling: 300 },
  );
}

/** The picture, once what was asked for is in it. */
async function picture(page) {
  await page.evaluate(() => window.restir.call(() => undefined));
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  return readDisplay(page);
}

test('a name that is being typed belongs to the view that is left; where the browser keeps nothing it is said', async () => {
  const { page, problems } = await openPage(site, query);
  try {
    await waitForFrames(page, 1);
    const [camera] = await entries(page);
    await drag(page, 60, 10);
    await page.click('#keep-view');
    await chosen(page, 'View 1');
    await page.click('#bookmark-name', { count: 3 });
    await page.keyboard.type('Corner');
    await page.mouse.move(100, 200);
    await page.mouse.wheel({ deltaY: 100 });
    await chosen(page, 'moved');
    assert.deepEqual(await entries(page), [camera, 'Corner']);
    await page.select('#camera', 'view-0');
    await chosen(page, 'Corner');
    await page.waitForSelector('#bookmark-row:not([hidden])');
    await page.evaluate(() => (Storage.prototype.setItem = () => { throw new Error('no room'); }));
    await page.click('#bookmark-delete');
    await page.waitForFunction(() => document.getElementById('message-text').textContent.includes('no room'), { polling: 50 });
    assert.deepEqual(await entries(page), [camera, 'Corner']);
    assertNoProblems(problems);
  } finally {
    await page.evaluate(() => localStorage.clear());
    await page.close();
  }
});

test('views are kept, chosen, named and deleted', async () => {
  const { page, problems } = await openPage(site, query);
  try {
    await waitForFrames(page, 1);
    const [camera] = await entries(page);
    const home = await picture(page);
    await drag(page, 60, 10);
    const first = await picture(page);
    await page.click('#keep-view');
    await chosen(page, 'View 1');
    await drag(page, -90, 20);
    const second = await picture(page);
    await page.click('#keep-view');
    await chosen(page, 'View 2');
    assert.deepEqual(await entries(page), [camera, 'View 1', 'View 2']);
    assert.equal(await page.$eval('#camera optgroup', (group) => group.label), 'Bookmarks');

    // By the menu.
    await page.select('#camera', 'view-0');
    await chosen(page, 'View 1');
    assert.deepEqual(await picture(page), first);
    await page.select('#camera', '0');
    await chosen(page, camera);
    assert.deepEqual(await picture(page), home);

    // By number, where no field is being written in.
    await page.focus('#canvas');
    await page.keyboard.press('3');
    await chosen(page, 'View 2');
    assert.deepEqual(await picture(page), second);
    await page.keyboard.press('9');
    await page.keyboard.press('1');
    await chosen(page, camera);
    assert.deepEqual(await picture(page), home);

    // Renamed, with digits in the name.
    await page.keyboard.press('2');
    await chosen(page, 'View 1');
    await page.click('#bookmark-name', { count: 3 });
    await page.keyboard.type('Left wall 3');
    await page.keyboard.press('Enter');
    await chosen(page, 'Left wall 3');
    assert.deepEqual(await picture(page), first);
    assert.deepEqual(await entries(page), [camera, 'Left wall 3', 'View 2']);

    // Another scene has none; in the same one, opened again, they are there.
    await page.select('#scene', 'furnace');
    await page.waitForFunction(() => location.search.includes('scene=furnace') && !document.querySelector('#camera optgroup'), { polling: 50 });
    await page.goto(site.url + query, { waitUntil: 'domcontentloaded' });
    await waitForFrames(page, 1);
    await page.select('#camera', 'view-0');
    await chosen(page, 'Left wall 3');
    const again = await picture(page);
    const close = again.filter((byte, at) => Math.abs(byte - first[at]) <= 2).length;
    assert.ok(close / again.length > 0.99, `${close} of ${again.length} values`);

    await page.click('#bookmark-delete');
    await page.waitForFunction(() => document.getElementById('bookmark-row').hidden, { polling: 50 });
    assert.deepEqual(await entries(page), [camera, 'View 2']);
    assert.deepEqual(await page.evaluate(() => Object.values(JSON.parse(localStorage.getItem('restir.bookmarks'))).map((list) => list.length)), [1]);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
});
