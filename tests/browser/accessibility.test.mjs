// What axe-core says of the pages: nothing of impact serious or critical, in any state, size and colour scheme.
import { strict as assert } from 'node:assert';
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { dist } from '../../scripts/build.mjs';
import { serve } from '../../scripts/serve.mjs';
import { browserName, launch } from './browsers.mjs';
import { assertNoProblems, openPage, waitForFrames, waitForMessage } from './pages.mjs';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const sizes = { wide: { width: 1280, height: 800 }, phone: { width: 390, height: 844 } };
// Firefox cannot be told a scheme through the protocol: it shows its own.
const schemes = browserName === 'chromium' ? ['light', 'dark'] : [undefined];

let folder;
let site;
before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'restir-accessibility-'));
  cpSync(dist, folder, { recursive: true });
  const element = '<restir-viewer src="cornell" technique="normals" scale="0.1" max-samples="1" controls alt="A box"></restir-viewer>';
  const head = '<!doctype html><html lang="en"><meta charset="utf-8"><title>A picture</title><style>restir-viewer { width: 300px; height: 200px }</style>';
  writeFileSync(join(folder, 'element.html'), `${head}<script type="module" src="element.js"></script><main><h1>A picture</h1>${element}${element.replace('cornell', 'bogus')}</main>`);
  const [{ browser, close: closeBrowser }, server] = await Promise.all([launch(), serve(folder, 0)]);
  site = { browser, url: server.url, close: () => Promise.all([closeBrowser(), server.close()]) };
});
after(async () => {
  await site?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** What axe finds of impact serious or critical: a line for each rule and element. */
async function faults(page) {
  if (!(await page.evaluate(() => 'axe' in window))) await page.evaluate(axe);
  return page.evaluate(async () => {
    const { violations } = await axe.run(document, { resultTypes: ['violations'], preload: false });
    return violations
      .filter(({ impact }) => impact === 'serious' || impact === 'critical')
      .flatMap(({ id, nodes }) => nodes.map(({ target, any, all, none }) => `${id}: ${target.flat().join(' ')}: ${[...any, ...all, ...none].map(({ message }) => message).join(' ')}`));
  });
}

/**
 * The faults in each colour scheme. What lies over a picture has to be read over any: the pictures make way for their extremes, black
 * and white, for axe does not look into a canvas.
 */
async function faultsOf(page, state) {
  const found = [];
  for (const scheme of schemes) {
    if (scheme) await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
    const overPicture = await page.evaluate(() => document.querySelector('#canvas') !== null);
    for (const ground of overPicture ? ['#000', '#fff'] : ['']) {
      await page.evaluate((colour) => {
        document.body.style.background = colour;
        if (!colour) return;
        for (const canvas of document.querySelectorAll('canvas')) canvas.style.opacity = 0;
      }, ground);
      for (const fault of await faults(page)) found.push(`${state}, ${scheme ?? 'its own colours'}${ground && `, over ${ground}`}: ${fault}`);
    }
  }
  return [...new Set(found)];
}

async function withPage(query, size, work, prepare) {
  const { page, problems } = await openPage(site, query, prepare);
  try {
    await page.setViewport(sizes[size]);
    await work(page);
    assertNoProblems(problems.filter((text) => !/favicon|404/.test(text)));
  } finally {
    await page.close();
  }
}

const removeGpu = () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined, configurable: true });

/** What a person may have open on the page, each from the state before it. */
const states = [
  ['panel', async (page) => {
    if (await page.$eval('#settings', ({ hidden }) => hidden)) await page.click('#fold');
    // What a parameter does is shown for the one that is pointed at.
    await page.addStyleTag({ content: '.parameter small { display: block !important }' });
  }],
  ['panel folded', (page) => page.click('#fold')],
  ['error', (page) => page.$eval('#errors', (popover) => (popover.open = true))],
  ['passes', (page) =>
    page.evaluate(() => {
      document.getElementById('errors').open = false;
      document.getElementById('timing').open = true;
    })],
  ['warnings', (page) =>
    page.evaluate(() => {
      document.getElementById('timing').open = false;
      document.getElementById('warnings').open = true;
    })],
  ['comparison', async (page) => {
    await page.evaluate(() => (document.getElementById('warnings').open = false));
    await page.click('#compare');
    await page.waitForFunction(() => document.getElementById('label-b').textContent !== '', { polling: 50 });
  }],
  ['inspector', async (page) => {
    await page.evaluate(() => {
      document.getElementById('compare').click();
      document.getElementById('inspect').click();
    });
    await page.waitForFunction(() => document.querySelector('#inspector details'), { polling: 50 });
    await page.evaluate(() => document.querySelectorAll('#inspector details').forEach((details) => (details.open = true)));
  }],
  ['a frame pass by pass', async (page) => {
    await page.evaluate(() => {
      document.getElementById('inspect').click();
      document.getElementById('dissect').click();
    });
    await page.waitForFunction(() => document.getElementById('steps-source').textContent.includes('One invocation'), { polling: 50 });
  }],
  ['message', (page) => page.evaluate(async () => (await import(new URL('notices.js', location.href).href)).showError({ code: 'IO', message: 'a file' }))],
  ['loading', (page) =>
    page.evaluate(async () => {
      const { clearError, showProgress } = await import(new URL('notices.js', location.href).href);
      clearError();
      showProgress('textures', 0.5, 'Loading');
    })],
  ['help', (page) => page.$eval('#help', (help) => help.showModal())],
];

for (const size of Object.keys(sizes)) {
  test(`the page, ${size}`, () =>
    // A scene that moves has controls for its time, and a wrong name in the address is a warning.
    withPage('?scene=motion&technique=normals&size=24x16&frames=1&accumulate=yes&bogus=1', size, async (page) => {
      await waitForFrames(page, 1);
      const found = [];
      for (const [state, open] of states) {
        await open(page);
        found.push(...(await faultsOf(page, state)));
      }
      assert.deepEqual(found, []);
    }));

  // Without WebGPU, for what shall be read is the same, and a dozen pictures take time.
  test(`pages to learn from, ${size}`, async () => {
    const found = [];
    for (const name of readdirSync(join(dist, 'learn')).filter((file) => file.endsWith('.html'))) {
      await withPage(`learn/${name}`, size, async (page) => {
        await page.waitForFunction(() => document.readyState === 'complete', { polling: 50 });
        found.push(...(await faultsOf(page, name)));
      }, removeGpu);
    }
    assert.deepEqual(found, []);
  });
}

test('an element with a picture, and one that says why it has none', () =>
  withPage('element.html', 'wide', async (page) => {
    const settled = () => {
      const [good, wrong] = document.querySelectorAll('restir-viewer');
      return good.viewer?.scene && !wrong.shadowRoot.querySelector('p').hidden;
    };
    await page.waitForFunction(settled, { polling: 50 });
    assert.deepEqual(await faultsOf(page, 'element'), []);
  }));

test('faults are found: a button without words, and words that can be read over a white picture alone', () =>
  withPage('', 'wide', async (page) => {
    await waitForMessage(page);
    // Dark words, for light surfaces, which a black picture darkens.
    await page.addStyleTag({ content: ':root { --surface: rgb(250 249 247 / 92%) !important; --text: #222 !important }' });
    const [before, sides] = [new Set(await faultsOf(page, 'before')), ['#000', '#fff']];
    await page.evaluate(() => {
      document.getElementById('settings').append(Object.assign(document.createElement('button'), { id: 'mute' }));
      document.getElementById('settings').prepend(Object.assign(document.createElement('p'), { id: 'faint', textContent: 'faint', style: 'color: #6e6e6e' }));
    });
    const found = (await faultsOf(page, 'before')).filter((fault) => !before.has(fault));
    for (const scheme of schemes) {
      const where = (side) => `before, ${scheme ?? 'its own colours'}, over ${side}: `;
      const told = sides.map((side) => found.filter((fault) => fault.startsWith(where(side))).map((fault) => fault.slice(where(side).length).split(': ').slice(0, 2).join(': ')).sort());
      assert.deepEqual(told, [['button-name: #mute', 'color-contrast: #faint'], ['button-name: #mute']], found.join('\n'));
    }
  }, removeGpu));
