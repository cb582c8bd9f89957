// The gallery: opened, looked through and chosen from, by clicks and by keys.
import { strict as assert } from 'node:assert';
import { readdirSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { dist } from '../../scripts/build.mjs';
import { contrast, openSite, readDisplay, waitForFrames, withPage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

const withGallery = (work) => withPage(site, '?scene=furnace&size=48x32&frames=2&technique=path-tracer', work);

const fetched = (page) => page.evaluate(() => performance.getEntriesByType('resource').map(({ name }) => name).filter((name) => name.includes('gallery')));
const focused = (page) => page.evaluate(() => document.activeElement.value);
const isOpen = (page) => page.$eval('#gallery-dialog', (dialog) => dialog.open);

async function open(page) {
  await page.click('#gallery');
  await page.waitForSelector('#gallery-dialog[open] li button');
}

/** Waits until the picture is that of `scene`, which has more in it than the furnace. */
async function untilShown(page, scene) {
  await page.waitForFunction((wanted) => new URLSearchParams(location.search).get('scene') === wanted, { polling: 50 }, scene);
  await waitForFrames(page, 2);
  assert.equal(await page.$eval('#scene', (menu) => menu.value), scene);
  assert.ok(contrast(await readDisplay(page), 48, 32) > 20);
}

test('every built-in scene has a picture, a line and a credit; nothing is fetched before the gallery is opened', () =>
  withGallery(async (page) => {
    assert.deepEqual(await fetched(page), []);
    await open(page);
    const names = await page.evaluate(async () => {
      const { RestirViewer } = await import('./viewer.js');
      return (await RestirViewer.describe()).scenes.map(({ name }) => name);
    });
    assert.ok(names.length >= 14);
    const credited = await page.evaluate(async () => Object.keys((await import('./gallery.js')).credits));
    assert.deepEqual(credited.sort(), [...names].sort());
    assert.deepEqual(readdirSync(join(dist, 'gallery')).sort(), names.map((name) => `${name}.webp`).sort());
    const bytes = names.reduce((sum, name) => sum + statSync(join(dist, 'gallery', `${name}.webp`)).size, 0);
    assert.ok(bytes < 300_000, `${bytes} bytes of pictures`);
    assert.match(await page.$eval('#gallery-dialog header', (header) => header.textContent), /MIT or Apache-2\.0/);
    for (const name of names) {
      const shown = await page.$eval(`#gallery-dialog button[value="${name}"]`, async (button) => {
        button.scrollIntoView();
        const picture = button.querySelector('img');
        await picture.decode();
        return { size: [picture.naturalWidth, picture.naturalHeight], title: button.querySelector('b').textContent, doc: button.querySelector('span').textContent, credit: button.querySelector('small').textContent };
      });
      assert.deepEqual(shown.size, [288, 192], name);
      assert.ok(shown.title.length > 3 && shown.doc.length > 20, name);
      assert.match(shown.credit, /^(Our own|After|The customary)/, name);
    }
  }));

test('a scene is chosen by a click', () =>
  withGallery(async (page) => {
    await open(page);
    assert.equal(await page.$eval('#gallery-dialog [aria-current]', ({ value }) => value), 'furnace');
    await page.click('#gallery-dialog button[value="cornell"]');
    assert.equal(await isOpen(page), false);
    // The address leaves out what is the default.
    await page.waitForFunction(() => !location.search.includes('furnace'), { polling: 50 });
    await waitForFrames(page, 2);
    assert.equal(await page.$eval('#scene', (menu) => menu.value), 'cornell');
    assert.ok(contrast(await readDisplay(page), 48, 32) > 20);
  }));

test('a scene is chosen by keys, and Escape leaves all as it is', () =>
  withGallery(async (page) => {
    await page.focus('#gallery');
    await page.keyboard.press('Enter');
    await page.waitForSelector('#gallery-dialog[open] li button');
    assert.equal(await focused(page), 'furnace', 'it opens at what is shown');
    await page.keyboard.press('Home');
    assert.equal(await focused(page), 'cornell');
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('ArrowDown');
    await page.keyboard.press('ArrowUp');
    assert.equal(await focused(page), 'cornell-64');
    await page.keyboard.press('Escape');
    assert.equal(await isOpen(page), false);
    assert.equal(await page.evaluate(() => document.activeElement.id), 'gallery');
    assert.equal(await page.$eval('#scene', (menu) => menu.value), 'furnace');

    await open(page);
    await page.keyboard.press('ArrowRight');
    assert.equal(await focused(page), 'veach-mis');
    await page.keyboard.press('Enter');
    await untilShown(page, 'veach-mis');
  }));

test('a file of one’s own is picked from there', () =>
  withGallery(async (page) => {
    await open(page);
    await page.evaluate(() => document.getElementById('file').addEventListener('click', (event) => (event.preventDefault(), (window.picked = true))));
    await page.click('#gallery-own');
    assert.equal(await page.evaluate(() => window.picked), true);
    assert.equal(await isOpen(page), false);
    assert.match(await page.$eval('#gallery-dialog p a', ({ href }) => href), /^https:\/\/github\.com\/KhronosGroup\//);
  }));

test('it fits a phone', () =>
  withGallery(async (page) => {
    await open(page);
    await page.setViewport({ width: 360, height: 640 });
    const { wide, inside } = await page.$eval('#gallery-dialog', (dialog) => ({ wide: dialog.scrollWidth - dialog.clientWidth, inside: dialog.getBoundingClientRect().right <= innerWidth }));
    assert.ok(wide <= 0 && inside);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 360));
  }));
