// The documentation in a real browser: it fits a phone, and follows the system's choice of light and dark.
import { strict as assert } from 'node:assert';
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { dist } from '../../scripts/build.mjs';
import { browserName } from './browsers.mjs';
import { assertNoProblems, openPage, openSite } from './pages.mjs';

const names = readdirSync(join(dist, 'docs'), { recursive: true }).filter((name) => name.endsWith('.html'));

/** To go on before all pictures have come is no fault. */
const isFault = (problem) => !/ABORTED|truncated/.test(problem);

let site;
before(async () => (site = await openSite()));
after(() => site.close());

test('no page is wider than a phone', async () => {
  const { page, problems } = await openPage(site, 'docs/');
  await page.setViewport({ width: 360, height: 740 });
  const wide = [];
  for (const name of names) {
    await page.goto(`${site.url}docs/${name}`, { waitUntil: 'domcontentloaded' });
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    if (width > 360) wide.push(`${name}: ${width}`);
  }
  assert.deepEqual(wide, []);
  assertNoProblems(problems.filter(isFault));
  await page.close();
});

test('contents lead on, and say where one is', async () => {
  const { page, problems } = await openPage(site, 'docs/');
  await page.setViewport({ width: 1280, height: 800 });
  await Promise.all([page.waitForNavigation(), page.click('#site-contents a[href="techniques/ris.html"]')]);
  assert.equal(await page.$eval('#site-contents [aria-current]', (link) => link.textContent), 'ris');
  assert.equal(await page.$eval('h1', (heading) => heading.textContent), 'ris');
  await Promise.all([page.waitForNavigation(), page.click('a[rel=next]')]);
  assert.equal(await page.$eval('h1', (heading) => heading.textContent), 'path-tracer');
  // Many pages of the lab: the one that is read is in sight.
  await page.goto(`${site.url}docs/lab/worth-it.html`, { waitUntil: 'load' });
  const seen = await page.$eval('#site-contents [aria-current]', (link) => {
    const { top, bottom } = link.getBoundingClientRect();
    return top > 0 && bottom < innerHeight;
  });
  assert.ok(seen);
  assertNoProblems(problems.filter(isFault));
  await page.close();
});

test('light and dark follow the system', { skip: browserName !== 'chromium' && 'Firefox cannot emulate it' }, async () => {
  const { page } = await openPage(site, 'docs/');
  const grounds = [];
  for (const value of ['light', 'dark']) {
    await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value }]);
    grounds.push(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
  }
  assert.notEqual(grounds[0], grounds[1]);
  await page.close();
});
