// Opens the built page in the browser under test and looks at what it shows.
import { strict as assert } from 'node:assert';
import { cpSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { serve } from '../../scripts/serve.mjs';
import { dist } from '../../scripts/build.mjs';
import { launch } from './browsers.mjs';

/** A software adapter on two busy cores may take this long for anything. */
const patience = 60_000;

/** The browser and the page's server, from a sub-path as a file host would have it. */
export async function openSite() {
  const [{ browser, close: closeBrowser }, server] = await Promise.all([launch(), serve(dist, 0, '/some/where/')]);
  return { browser, url: server.url, close: () => Promise.all([closeBrowser(), server.close()]) };
}

/** The browser and a server of `folder`, an empty one of one's own, with the package in `restir/`. */
export async function openEmbedding() {
  const folder = mkdtempSync(join(tmpdir(), 'restir-embedding-'));
  cpSync(dist, join(folder, 'restir'), { recursive: true });
  const [{ browser, close: closeBrowser }, server] = await Promise.all([launch(), serve(folder, 0)]);
  const close = async () => {
    await Promise.all([closeBrowser(), server.close()]);
    rmSync(folder, { recursive: true, force: true });
  };
  return { browser, url: server.url, folder, close };
}

/** Opens the page with `query`. `problems` collects console errors, exceptions and failed requests. `before` runs ahead of its scripts; `prepare` is given the page first. */
export async function openPage({ browser, url }, query, before, prepare) {
  const page = await browser.newPage();
  page.setDefaultTimeout(patience);
  await page.setViewport({ width: 640, height: 400 });
  prepare?.(page);
  const problems = [];
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('requestfailed', (request) => problems.push(`${request.url()}: ${request.failure()?.errorText}`));
  if (before) await page.evaluateOnNewDocument(before);
  await page.goto(url + query, { waitUntil: 'domcontentloaded' });
  return { page, problems };
}

/** Waits until the viewer has `frames` frames in its picture; fails at once if the page shows a message instead. */
export async function waitForFrames(page, frames) {
  const handle = await page.waitForFunction(
    async (wanted) => {
      const message = document.getElementById('message');
      const counted = window.restir.call((viewer) => viewer.frames());
      // Without a viewer the call waits for one, so the message is looked at meanwhile.
      const count = await Promise.race([counted, new Promise((resolve) => setTimeout(resolve, 100, 0))]);
      if (!message.hidden) return message.innerText;
      return count >= wanted ? 'done' : false;
    },
    { polling: 50 },
    frames,
  );
  assert.equal(await handle.jsonValue(), 'done', 'the page shows a message');
}

/** The displayed pixels: three bytes each, row-major from the top. */
export async function readDisplay(page) {
  // Base64, for an array of numbers takes seconds through the browser protocols.
  const text = await page.evaluate(async () => {
    const bytes = await window.restir.call((viewer) => viewer.read_display());
    let binary = '';
    for (const byte of bytes) binary += String.fromCharCode(byte);
    return btoa(binary);
  });
  const rgba = Buffer.from(text, 'base64');
  return Uint8Array.from({ length: (rgba.length / 4) * 3 }, (_, at) => rgba[Math.floor(at / 3) * 4 + (at % 3)]);
}

/** The text of the message the page shows, once it shows one. */
export async function waitForMessage(page) {
  await page.waitForFunction(() => !document.getElementById('message').hidden, { polling: 50 });
  return page.evaluate(() => document.getElementById('message').innerText);
}

/** Mean over all bytes. */
export const mean = (bytes) => bytes.reduce((sum, byte) => sum + byte, 0) / bytes.length;

/** The largest mean brightness of an 8 by 8 grid of tiles, minus the smallest: 0 for a flat picture. */
export function contrast(rgb, width, height) {
  const tiles = Array.from({ length: 64 }, () => ({ sum: 0, count: 0 }));
  for (let at = 0; at < rgb.length; at++) {
    const pixel = Math.floor(at / 3);
    const tile = tiles[Math.floor((Math.floor(pixel / width) * 8) / height) * 8 + Math.floor(((pixel % width) * 8) / width)];
    tile.sum += rgb[at];
    tile.count += 1;
  }
  const means = tiles.filter(({ count }) => count > 0).map(({ sum, count }) => sum / count);
  return Math.max(...means) - Math.min(...means);
}

/** Fails with all of them if the page had problems. */
export function assertNoProblems(problems) {
  assert.deepEqual(problems, [], 'console errors, exceptions or failed requests');
}

/** Opens the page as `openPage` does, waits for its first frame, does the `work`, and fails if the page had problems. */
export async function withPage(site, query, work, before) {
  const { page, problems } = await openPage(site, query, before);
  try {
    await waitForFrames(page, 1);
    await work(page);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
}

/** Opens or closes what folds in the footer. The status line beside it changes its width, and a click by place may miss. */
export const unfold = (page, id) => page.$eval(`#${id} summary`, (summary) => summary.click());
