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

/** The elements of an EBML file that are asked for: id to content; masters are given as their elements. */
const masters = new Set([0x1a45dfa3, 0x18538067, 0x1549a966, 0x1654ae6b, 0xae, 0xe0, 0x1f43b675, 0x1c53bb6b, 0xbb, 0xb7, 0x114d9b74, 0x4dbb]);
function elementsOf(bytes, base = 0) {
  const found = [];
  for (let at = 0; at < bytes.length; ) {
    const place = base + at;
    const idLength = Math.clz32(bytes[at]) - 23;
    const id = bytes.readUIntBE(at, idLength);
    at += idLength;
    const sizeLength = Math.clz32(bytes[at]) - 23;
    const size = Number(BigInt(`0x${bytes.toString('hex', at, at + sizeLength)}`) - (1n << BigInt(7 * sizeLength)));
    at += sizeLength;
    const content = bytes.subarray(at, at + size);
    assert.equal(content.length, size, 'an element ends within its parent');
    found.push({ id, place, content, children: masters.has(id) ? elementsOf(content, base + at) : [] });
    at += size;
  }
  return found;
}
const uint = (content) => Number(BigInt(`0x${content.toString('hex') || '0'}`));
const all = (elements, id) => elements.flatMap((each) => [...(each.id === id ? [each] : []), ...all(each.children, id)]);
const only = (elements, id) => {
  const found = all(elements, id);
  assert.equal(found.length, 1, `element ${id.toString(16)}`);
  return found[0].content;
};

/** Seconds of each frame, and the places that the index says are clusters. */
function readWebm(bytes) {
  const elements = elementsOf(bytes);
  const tick = uint(only(elements, 0x2ad7b1)) * 1e-9;
  const clusters = all(elements, 0x1f43b675);
  const times = clusters.flatMap(({ children }) => {
    const start = uint(only(children, 0xe7));
    return all(children, 0xa3).map(({ content }) => (start + content.readInt16BE(1)) * tick);
  });
  const segment = elements.find(({ id }) => id === 0x18538067);
  const begin = segment.children[0].place;
  assert.deepEqual(all(elements, 0xf1).map(({ content }) => uint(content)), clusters.map(({ place }) => place - begin), 'the index points at clusters');
  const found = new Map(all(elements, 0x4dbb).map(({ children }) => [uint(only(children, 0x53ab)), uint(only(children, 0x53ac))]));
  for (const [id, place] of found) assert.equal(segment.children.find((each) => each.id === id).place - begin, place);
  return { times, duration: only(elements, 0x4489).readDoubleBE() * tick, codec: String(only(elements, 0x86)), size: [uint(only(elements, 0xb0)), uint(only(elements, 0xba))] };
}

test('a WebM file has every frame at its time, at any rate and length', async () => {
  const { webm } = await import(new URL('../../dist/webm.js', import.meta.url));
  for (const [rate, count] of [[24, 100], [30000 / 1001, 70], [0.1, 3], [1000, 9999], [7, 1]]) {
    const frames = Array.from({ length: count }, (_, at) => ({ bytes: new Uint8Array(at % 300), isKey: at === 0 }));
    const file = webm(frames, { codec: 'V_VP9', width: 300, height: 20, rate });
    const { times, duration, codec, size } = readWebm(Buffer.from(await file.arrayBuffer()));
    assert.deepEqual([times.length, codec, size], [count, 'V_VP9', [300, 20]]);
    for (const [at, time] of [...times, duration].entries()) assert.ok(Math.abs(time - at / rate) <= 1e-9 * (at + 1), `frame ${at} of ${rate} a second is at ${time}`);
  }
});

/** Pictures of a video at these seconds, RGB, as the browser shows them. */
const seekAll = (page, bytes, times) =>
  page.evaluate(
    async (text, moments) => {
      const video = document.createElement('video');
      video.muted = true;
      video.src = URL.createObjectURL(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], { type: 'video/webm' }));
      await new Promise((resolve, reject) => Object.assign(video, { onloadeddata: resolve, onerror: () => reject(new Error(video.error?.message)) }));
      const context = Object.assign(document.createElement('canvas'), { width: video.videoWidth, height: video.videoHeight }).getContext('2d', { willReadFrequently: true });
      const pictures = [];
      for (const moment of moments) {
        const seeked = new Promise((resolve) => (video.onseeked = resolve));
        // A picture may be there a little after its moment is; none comes where it is the same as before.
        const presented = new Promise((resolve) => video.requestVideoFrameCallback(resolve));
        video.currentTime = moment;
        await seeked;
        await Promise.race([presented, new Promise((resolve) => setTimeout(resolve, 1000))]);
        context.drawImage(video, 0, 0);
        pictures.push([...context.getImageData(0, 0, video.videoWidth, video.videoHeight).data].filter((_, at) => at % 4 < 3));
      }
      return { duration: video.duration, size: [video.videoWidth, video.videoHeight], pictures };
    },
    bytes.toString('base64'),
    times,
  );

const distance = (a, b) => a.reduce((sum, value, at) => sum + Math.abs(value - b[at]), 0) / a.length;

test('an animation becomes a video whose frames are at their moments', () =>
  open('?scene=motion&technique=normals&size=64x48&time=0.5&accumulate=yes&frames=1', async (page) => {
    const before = await readDisplay(page);
    await unfold(page, 'recording');
    for (const [id, text] of [['count', '40'], ['rate', '24'], ['samples', '1']]) await fill(page, `record-${id}`, text);
    await page.click('#record-exact');
    const { name, bytes } = await saved(page);
    assert.equal(name, 'motion-normals.webm');
    const { times, duration, size } = readWebm(bytes);
    assert.deepEqual([times.length, size], [40, [64, 48]]);
    for (const [at, time] of times.entries()) assert.ok(Math.abs(time - at / 24) < 1e-7, `frame ${at} is at ${time}`);
    assert.ok(Math.abs(duration - 40 / 24) < 1e-6);
    await page.waitForFunction(() => document.getElementById('record-words').textContent === '40 pictures saved.', { polling: 50 });
    await waitForFrames(page, 1);
    assert.deepEqual(await readDisplay(page), before, 'the page goes on as before');

    // The same moments one by one.
    await page.evaluate(() => (window.saved = undefined));
    await page.click('#record-pictures');
    const pictures = [...unzip((await saved(page)).bytes).values()].map((file) => [...decodePng(file).rgb]);
    const shown = [0, 13, 29, 30, 39];
    const played = await seekAll(page, bytes, shown.map((at) => (at + 0.5) / 24));
    assert.deepEqual(played.size, [64, 48]);
    assert.ok(Math.abs(played.duration - 40 / 24) < 0.01, `${played.duration} s`);
    for (const [index, at] of shown.entries()) {
      const distances = pictures.map((picture) => distance(played.pictures[index], picture));
      console.log(`frame ${at}: ${distances[at].toFixed(2)}, next best ${Math.min(...distances.filter((_, other) => other !== at)).toFixed(2)}`);
      assert.ok(distances[at] < 8, `frame ${at} is off by ${distances[at]}`);
      assert.equal(distances.indexOf(Math.min(...distances)), at, `frame ${at} looks like ${distances.indexOf(Math.min(...distances))}: ${distances}`);
    }
  }));

test('a video of an animation can be given up, and where nothing encodes one the page says so', async () => {
  await open('?scene=motion&technique=normals&size=32x24&accumulate=yes&frames=1', async (page) => {
    await unfold(page, 'recording');
    await fill(page, 'record-count', '9999');
    await page.click('#record-exact');
    await page.waitForFunction(() => /Picture [2-9]/.test(document.getElementById('record-words').textContent), { polling: 20 });
    assert.ok(await page.$eval('#record-pictures', (button) => button.disabled));
    await page.click('#record-exact');
    await page.waitForFunction(() => document.getElementById('record-words').textContent === 'Cancelled.', { polling: 50 });
    assert.deepEqual(await page.$$eval('#record-pictures, #record-exact', (buttons) => buttons.map((button) => [button.textContent, button.disabled])), [['Save pictures', false], ['Save video', false]]);
  });
  await open(
    '?scene=motion&technique=normals&size=16x16&accumulate=yes&frames=1',
    async (page) => {
      await unfold(page, 'recording');
      await page.click('#record-exact');
      const words = await waitForMessage(page);
      assert.match(words, /no VideoEncoder/);
      assert.match(words, /Save the pictures/);
      assert.equal(await page.$eval('#record-exact', (button) => button.textContent), 'Save video');
    },
    () => delete window.VideoEncoder,
  );
});

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

test('a recording is cancelled within a picture, and another scene need not wait for it', () =>
  withPage(site, '?scene=motion&technique=normals&scale=0.1', async (page) => {
    await unfold(page, 'recording');
    const words = (part) => page.waitForFunction((wanted) => document.getElementById('record-words').textContent.includes(wanted), { polling: 50 }, part);
    const begin = async () => {
      for (const [id, count] of [['record-count', 2], ['record-samples', 65536]]) await fill(page, id, String(count));
      await page.click('#record-pictures');
      await words('Picture 1 of 2');
    };
    await begin();
    await page.click('#record-pictures');
    await words('Cancelled.');
    const isOver = () => page.waitForFunction(() => document.getElementById('record-pictures').textContent !== 'Cancel', { polling: 50 });
    await isOver();
    await begin();
    // The pictures keep their size, which is no choice that the address tells.
    await page.setViewport({ width: 700, height: 420 });
    await new Promise((resolve) => setTimeout(resolve, 500));
    assert.doesNotMatch(page.url(), /size=/);
    await page.select('#scene', 'furnace');
    await isOver();
    await page.waitForFunction(() => location.search.includes('scene=furnace'), { polling: 50 });
    await waitForFrames(page, 1);
    assert.equal(await page.$eval('#message', ({ hidden }) => hidden), true);
  }));
