// Moving pictures: a WebM video of what is shown, and an animation's pictures in a zip.
import { strict as assert } from 'node:assert';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openPage, openSite, readDisplay, unfold, waitForFrames, waitForMessage, withPage } from './pages.mjs';
import { decodePng } from './png.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Keeps what would be downloaded. */
const keepDownloads = () => {
  HTMLAnchorElement.prototype.click = function () {
    window.saved = fetch(this.href).then(async (file) => {
      let binary = '';
      for (const byte of new Uint8Array(await file.arrayBuffer())) binary += String.fromCharCode(byte);
      return { name: this.download, text: btoa(binary) };
    });
  };
};

async function saved(page) {
  const handle = await page.waitForFunction(() => window.saved, { polling: 50 });
  const { name, text } = await handle.jsonValue();
  return { name, bytes: Buffer.from(text, 'base64') };
}

const open = (query, work, prepare = keepDownloads) => withPage(site, query, work, prepare);

/** The files of a zip, by name, as the system unpacks it. */
function unzip(bytes) {
  const folder = mkdtempSync(join(tmpdir(), 'restir-zip-'));
  try {
    const archive = join(folder, 'archive.zip');
    writeFileSync(archive, bytes);
    const files = join(folder, 'files');
    // It also checks every sum.
    execFileSync('python3', ['-c', 'import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); assert z.testzip() is None; z.extractall(sys.argv[2])', archive, files]);
    return new Map(readdirSync(files).sort().map((name) => [name, readFileSync(join(files, name))]));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

const fill = (page, id, text) => page.$eval(`#${id}`, (input, value) => (input.value = value), text);

test('a zip holds its files, empty ones as well', async () => {
  const { zip } = await import(new URL('../../dist/zip.js', import.meta.url));
  const files = new Map([['a.txt', Buffer.from('hello')], ['b.bin', Buffer.from(Array.from({ length: 3000 }, (_, at) => (at * 7) & 255))], ['c', Buffer.alloc(0)]]);
  const archive = zip([...files].map(([name, bytes]) => ({ name, bytes: new Uint8Array(bytes) })));
  assert.deepEqual(unzip(Buffer.from(await archive.arrayBuffer())), files);
  assert.throws(() => zip(Array.from({ length: 65_536 }, () => ({ name: 'x', bytes: new Uint8Array() }))), { code: 'LIMIT' });
});

test('the pictures of an animation are those of their moments, and the page goes on as before', () =>
  open('?scene=motion&technique=path-tracer&render.max_depth=1&size=32x24&time=0.5&accumulate=yes&frames=2&seed=3', async (page) => {
    await waitForFrames(page, 2);
    const before = await readDisplay(page);
    await unfold(page, 'recording');
    await fill(page, 'record-count', '');
    await page.click('#record-pictures');
    assert.match(await page.$eval('#record-words', (words) => words.textContent), /must be numbers/);
    await fill(page, 'record-count', '3');
    await fill(page, 'record-rate', '2');
    await fill(page, 'record-samples', '2');
    await page.click('#record-pictures');
    const { name, bytes } = await saved(page);
    assert.equal(name, 'motion-path-tracer.zip');
    const files = unzip(bytes);
    assert.deepEqual([...files.keys()], [0, 1, 2].map((at) => `motion-path-tracer-000${at}.png`));
    const pictures = [...files.values()].map((file) => decodePng(file));
    assert.deepEqual([pictures[0].width, pictures[0].height], [32, 24]);
    assert.deepEqual(pictures[0].rgb, before);
    assert.notDeepEqual(pictures[1].rgb, pictures[0].rgb);
    assert.notDeepEqual(pictures[2].rgb, pictures[1].rgb);
    await page.waitForFunction(() => document.getElementById('record-words').textContent === '3 pictures saved.', { polling: 50 });
    await waitForFrames(page, 2);
    assert.deepEqual(await readDisplay(page), before);

    // The last one is what a link to its moment shows.
    const other = await openPage(site, '?scene=motion&technique=path-tracer&render.max_depth=1&size=32x24&time=1.5&accumulate=yes&frames=2&seed=3');
    await waitForFrames(other.page, 2);
    assert.deepEqual(await readDisplay(other.page), pictures[2].rgb);
    await other.page.close();

    // Many can be given up.
    await fill(page, 'record-count', '9999');
    await page.click('#record-pictures');
    await page.waitForFunction(() => /Picture [2-9]/.test(document.getElementById('record-words').textContent), { polling: 20 });
    await page.click('#record-pictures');
    await page.waitForFunction(() => document.getElementById('record-words').textContent === 'Cancelled.', { polling: 50 });
    await waitForFrames(page, 2);
    assert.deepEqual(await readDisplay(page), before);
  }));

test('a video is a WebM file with moving pictures in it', () =>
  open('?scene=motion&technique=normals&size=64x48', async (page) => {
    await unfold(page, 'recording');
    await page.click('#record-video');
    await page.waitForFunction(() => /^Stop, ([3-9]|\d\d) s$/.test(document.getElementById('record-video').textContent), { polling: 50 });
    assert.equal(await page.$eval('#record-video', (button) => button.ariaPressed), 'true');
    await page.click('#record-video');
    const { name, bytes } = await saved(page);
    assert.equal(name, 'motion-normals.webm');
    assert.equal(bytes.subarray(0, 4).toString('hex'), '1a45dfa3');
    assert.ok(bytes.length > 500, `${bytes.length} bytes`);
    await page.waitForFunction(() => document.getElementById('record-video').textContent === 'Record video', { polling: 50 });
    // The browser shows it, in the size of the picture, and the pictures in it move.
    const { size, count, moved } = await page.evaluate(async (text) => {
      const video = document.createElement('video');
      video.muted = true;
      video.src = URL.createObjectURL(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: 'video/webm' }));
      await new Promise((resolve, reject) => Object.assign(video, { onloadeddata: resolve, onerror: () => reject(new Error('no video')) }));
      const context = Object.assign(document.createElement('canvas'), { width: video.videoWidth, height: video.videoHeight }).getContext('2d', { willReadFrequently: true });
      const look = () => {
        context.drawImage(video, 0, 0);
        return [...context.getImageData(0, 0, video.videoWidth, video.videoHeight).data];
      };
      const looks = [];
      const timer = setInterval(() => looks.push(look()), 100);
      const ended = new Promise((resolve) => (video.onended = resolve));
      await video.play();
      await ended;
      clearInterval(timer);
      const pictures = [...looks, look()].filter((values) => new Set(values).size > 20);
      const [first, last] = [pictures[0] ?? [], pictures.at(-1) ?? []];
      return { size: [video.videoWidth, video.videoHeight], count: pictures.length, moved: last.filter((value, at) => Math.abs(value - first[at]) > 16).length };
    }, bytes.toString('base64'));
    assert.deepEqual(size, [64, 48]);
    assert.ok(count > 1, `${count} pictures`);
    assert.ok(moved > 100, `${moved} values moved`);
  }));

test('where the browser records no video it says so', () =>
  open(
    '?scene=cornell&technique=normals&size=16x16&frames=1',
    async (page) => {
      await unfold(page, 'recording');
      await page.click('#record-video');
      assert.match(await waitForMessage(page), /records no video/);
      assert.equal(await page.$eval('#record-video', (button) => button.textContent), 'Record video');
    },
    () => delete window.MediaRecorder,
  ));
