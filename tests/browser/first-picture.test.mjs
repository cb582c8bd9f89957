// How long a visitor waits. In a file of its own: no other browser runs meanwhile.
import { strict as assert } from 'node:assert';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { brotliCompressSync } from 'node:zlib';
import { dist } from '../../scripts/build.mjs';
import { browserName, slack } from './browsers.mjs';
import { assertNoProblems, openPage, openSite, waitForFrames } from './pages.mjs';

/** Milliseconds from navigation to the first picture, in a browser just started: nothing is cached. */
async function firstPicture() {
  const fresh = await openSite();
  try {
    const { page, problems } = await openPage(fresh, '');
    await waitForFrames(page, 1);
    assertNoProblems(problems);
    return await page.evaluate(() => performance.getEntriesByName('picture')[0].startTime);
  } finally {
    await fresh.close();
  }
}

// Most of it is spent on pipelines, which the software adapter of Chromium compiles one after another.
const onlyChromium = { skip: browserName !== 'chromium' };

test('shows a first picture of cornell within 5 s of navigation', onlyChromium, async (context) => {
  const [times, limit] = [[], 5000 * slack];
  // Other work on the machine only adds to the time, so the best of three is the nearest to the truth.
  while (times.length < 3 && !(times.at(-1) < limit)) times.push(await firstPicture());
  context.diagnostic(`first picture after ${times.map((time) => time.toFixed(0)).join(', ')} ms`);
  assert.ok(times.at(-1) < limit, `first picture after ${times.map((time) => time.toFixed(0)).join(', ')} ms`);
});

test('at most 500 KB, as brotli, are fetched before the first picture', async (context) => {
  const site = await openSite();
  try {
    const fetched = new Set();
    const { page } = await openPage(site, '', undefined, (page) => page.on('response', (response) => fetched.add(new URL(response.url()).pathname)));
    await waitForFrames(page, 1);
    const base = new URL(site.url).pathname;
    const sizes = [...fetched].filter((path) => path.startsWith(base)).map((path) => {
      const file = path.slice(base.length) || 'index.html';
      return [file, brotliCompressSync(readFileSync(join(dist, file))).length];
    });
    const total = sizes.reduce((sum, [, size]) => sum + size, 0) / 1000;
    context.diagnostic(`${sizes.length} files, ${total.toFixed(0)} KB`);
    assert.ok(sizes.some(([file]) => file.endsWith('.wasm')), 'the module is among them');
    assert.ok(total <= 500, sizes.sort((a, b) => b[1] - a[1]).map((each) => each.join(' ')).join(', '));
  } finally {
    await site.close();
  }
});
