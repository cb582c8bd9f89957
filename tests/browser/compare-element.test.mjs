// The attribute `compare` of <restir-viewer>: two pictures with a divider in a page that is not restir's own.
import { strict as assert } from 'node:assert';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { assertNoProblems, openEmbedding, openPage } from './pages.mjs';
import { decodePng } from './png.mjs';

let folder;
let site;
before(async () => {
  site = await openEmbedding();
  ({ folder } = site);
});
after(() => site?.close());

const html = `<!doctype html>
<style>body { margin: 20px; } restir-viewer { width: 200px; height: 100px; }</style>
<script type="module" src="restir/element.js"></script>
<restir-viewer src="builtin:cornell" technique="normals" params="render.pixel_filter=center" scale="0.5" max-samples="2" controls
  compare="technique=ris&amp;candidates=4&amp;render.pixel_filter=center"></restir-viewer>`;

test('two pictures in the element: a divider for hand and keys, live settings, and one camera', async () => {
  writeFileSync(join(folder, 'page.html'), html);
  const { page, problems } = await openPage(site, 'page.html');
  const until = (work, ...given) => page.waitForFunction(work, { polling: 50 }, ...given);
  const label = (text) => until((wanted) => document.querySelector('restir-viewer').shadowRoot.querySelector('#label-b')?.textContent === wanted, text);
  const pixels = (side) =>
    page.evaluate(async (name) => [...(await document.querySelector('restir-viewer')[name].capture({ type: 'rgba' })).data].join(), side);
  /** Colours seen on the element, at fractions of its width. */
  const seen = async (...places) => {
    const { rgb } = decodePng(Buffer.from(await page.screenshot({ clip: { x: 20, y: 90, width: 200, height: 1 } })));
    return places.map((place) => [...rgb.subarray(3 * 200 * place, 3 * 200 * place + 3)].join());
  };
  const now = () => page.evaluate(() => document.querySelector('restir-viewer').shadowRoot.querySelector('#divider').ariaValueNow);
  try {
    await label('B: ris, 2 frames');
    assert.notEqual(await pixels('viewer'), await pixels('second'));
    const settings = await page.evaluate(() => [...document.querySelector('restir-viewer').second.settings.values].join(' '));
    assert.equal(settings, 'candidates,4 render.pixel_filter,center');

    // The keys of the divider: all of A, all of B.
    await page.evaluate(() => document.querySelector('restir-viewer').shadowRoot.querySelector('#divider').focus());
    await page.keyboard.press('End');
    const onlyA = await seen(0.4, 0.62);
    await page.keyboard.press('Home');
    const onlyB = await seen(0.4, 0.62);
    assert.ok(onlyA[0] !== onlyB[0] && onlyA[1] !== onlyB[1]);
    await page.keyboard.press('ArrowRight');
    assert.equal(await now(), '2');

    // The hand takes it to the middle of the element, which does not begin at the page's edge.
    await page.mouse.move(24, 60);
    await page.mouse.down();
    await page.mouse.move(120, 60, { steps: 3 });
    await page.mouse.up();
    assert.equal(await now(), '50');
    assert.deepEqual(await seen(0.4, 0.62), [onlyA[0], onlyB[1]]);

    // Live: other settings for B, and no other scene is loaded for them.
    await page.evaluate(() => document.querySelector('restir-viewer').setAttribute('compare', 'technique=normals&render.pixel_filter=center'));
    await label('B: normals, 2 frames');
    assert.equal(await pixels('second'), await pixels('viewer'));

    // One camera for both.
    const first = await pixels('viewer');
    await page.mouse.move(60, 80);
    await page.mouse.down();
    await page.mouse.move(80, 84, { steps: 2 });
    await page.mouse.up();
    await until(() => {
      const { viewer, second } = document.querySelector('restir-viewer');
      return viewer.settings.pose && JSON.stringify(viewer.camera().position) === JSON.stringify(second.camera().position);
    });
    await label('B: normals, 2 frames');
    assert.notEqual(await pixels('viewer'), first);
    assert.equal(await pixels('second'), await pixels('viewer'));

    // A wrong name is told as any other.
    await page.evaluate(() => document.querySelector('restir-viewer').setAttribute('compare', 'technique=bogus'));
    await until(() => document.querySelector('restir-viewer').shadowRoot.querySelector('[role=alert]').innerText.includes('bogus'));

    await page.evaluate(() => document.querySelector('restir-viewer').removeAttribute('compare'));
    await until(() => document.querySelector('restir-viewer').second === undefined);
    assert.equal(await page.evaluate(() => document.querySelector('restir-viewer').shadowRoot.querySelectorAll('canvas, #divider:not([hidden]), #labels:not([hidden])').length), 1);
    assertNoProblems(problems.filter((text) => !/favicon|404/.test(text)));
  } finally {
    await page.close();
  }
});
