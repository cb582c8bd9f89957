// OpenEXR files of the page: what other tools read in them, and that they are what the command line writes.
import { strict as assert } from 'node:assert';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { inflateSync } from 'node:zlib';
import { run } from '../../scripts/run.mjs';
import { softwareEnvironment } from '../../scripts/environment.mjs';
import { openSite, withPage } from './pages.mjs';

let site;
let folder;
before(async () => {
  site = await openSite();
  folder = mkdtempSync(join(tmpdir(), 'restir-exr-'));
});
after(() => {
  rmSync(folder, { recursive: true, force: true });
  return site.close();
});

const restir = (...words) => run(['cargo', 'run', '--quiet', '--', ...words], { env: softwareEnvironment() });

/** Channels of 32-bit float by name, and attributes of strings, of a file with ZIP compression. */
function readExr(bytes) {
  assert.equal(bytes.readUInt32LE(0), 20000630);
  let at = 8;
  const name = () => {
    const end = bytes.indexOf(0, at);
    const text = bytes.toString('latin1', at, end);
    at = end + 1;
    return text;
  };
  const attributes = new Map();
  for (let key = name(); key; key = name()) {
    const type = name();
    const size = bytes.readInt32LE(at);
    attributes.set(key, { type, value: bytes.subarray(at + 4, at + 4 + size) });
    at += 4 + size;
  }
  const [, , right, bottom] = new Int32Array(Uint8Array.from(attributes.get('dataWindow').value).buffer);
  const [width, height] = [right + 1, bottom + 1];
  const list = attributes.get('channels').value;
  const channels = new Map();
  for (let place = 0; list[place] !== 0; ) {
    const end = list.indexOf(0, place);
    assert.equal(list.readInt32LE(end + 1), 2, '32-bit float');
    channels.set(list.toString('latin1', place, end), new Float32Array(width * height));
    place = end + 17;
  }
  assert.equal(attributes.get('compression').value[0], 3, 'ZIP');
  for (let chunk = 0; chunk < Math.ceil(height / 16); chunk++) {
    const start = Number(bytes.readBigUInt64LE(at + 8 * chunk));
    const [first, size] = [bytes.readInt32LE(start), bytes.readInt32LE(start + 4)];
    assert.equal(first, 16 * chunk);
    const rows = Math.min(16, height - first);
    const whole = rows * width * channels.size * 4;
    let data = Buffer.from(bytes.subarray(start + 8, start + 8 + size));
    if (size < whole) {
      const differences = inflateSync(data);
      for (let place = 1; place < differences.length; place++) differences[place] += differences[place - 1] - 128;
      data = Buffer.from(Uint8Array.from(differences, (_, place) => differences[(place >> 1) + (place & 1 ? Math.ceil(whole / 2) : 0)]));
    }
    assert.equal(data.length, whole);
    let place = 0;
    for (let row = first; row < first + rows; row++) {
      for (const values of channels.values()) for (let x = 0; x < width; x++, place += 4) values[row * width + x] = data.readFloatLE(place);
    }
  }
  const texts = [...attributes].filter(([, { type }]) => type === 'string').map(([key, { value }]) => [key, String(value)]);
  return { width, height, channels, attributes: Object.fromEntries(texts), kinds: [...attributes.keys()] };
}

/** What the element or the page saves, as bytes. */
const bytesOf = async (page, expression) => {
  const text = await page.evaluate(async (source) => {
    const blob = await eval(source);
    let binary = blob.type + '|';
    for (const byte of new Uint8Array(await blob.arrayBuffer())) binary += String.fromCharCode(byte);
    return btoa(binary);
  }, expression);
  const all = Buffer.from(text, 'base64');
  const cut = all.indexOf('|');
  return { type: all.toString('latin1', 0, cut), bytes: all.subarray(cut + 1) };
};

/** Most values agree to so much of themselves; two drivers never do in every pixel (tests/browser/page.test.mjs). */
const [closeValue, closeShare] = [0.02, 0.99];

/** As `withPage`, with what the work returns. */
async function opened(query, work) {
  let result;
  await withPage(site, query, async (page) => (result = await work(page)));
  return result;
}

/** Saves the EXR of what `query` shows once `done` of the viewer says so, and compares it with what `restir render` makes of the `words`. */
const compared = (context, query, done, words) =>
  opened(query, async (page) => {
    await page.waitForFunction((source) => window.restir.call(eval(source)), { polling: 50 }, done);
    await page.evaluate(() => {
      HTMLAnchorElement.prototype.click = function () {
        window.saved = { name: this.download, file: fetch(this.href).then((file) => file.blob()) };
      };
    });
    await page.click('#save-exr');
    await page.waitForFunction(() => window.saved, { polling: 50 });
    assert.match(await page.evaluate(() => window.saved.name), /^motion-.*\.exr$/);
    const { type, bytes } = await bytesOf(page, 'window.saved.file');
    assert.equal(type, 'image/x-exr');
    const [own, native] = ['page.exr', 'native.exr'].map((name) => join(folder, name));
    writeFileSync(own, bytes);
    await restir('render', 'builtin:motion', ...words, '--size', '61x37', '--seed', '1', '--out', native);

    const [here, there] = [bytes, readFileSync(native)].map(readExr);
    assert.deepEqual([here.width, here.height], [61, 37]);
    assert.deepEqual([...here.channels.keys()], [...there.channels.keys()]);
    assert.deepEqual([...here.kinds].sort(), [...there.kinds].sort());
    for (const [name, expected] of there.channels) {
      const values = here.channels.get(name);
      const largest = Math.max(...expected.map(Math.abs));
      const close = values.filter((value, at) => Math.abs(value - expected[at]) <= closeValue * Math.max(Math.abs(expected[at]), 0.01 * largest)).length;
      context.diagnostic(`${name}: ${close} of ${values.length} values agree`);
      assert.ok(close >= closeShare * values.length, `${name}: ${close} of ${values.length} values agree`);
    }
    // The project's own reader takes it, too.
    const { mse } = JSON.parse(await restir('compare', own, native, '--json'));
    const mean = here.channels.get('G').reduce((sum, value) => sum + Math.abs(value), 0) / (61 * 37);
    context.diagnostic(`MSE ${mse}, mean ${mean}`);
    assert.ok(Math.sqrt(mse) < 0.05 * mean, `MSE ${mse}, mean ${mean}`);
    return [here, there];
  });

/** How many values a channel has. */
const values = (file, name) => new Set(file.channels.get(name)).size;

test('the EXR of an averaged picture is that of the command line', async (context) => {
  const query = '?scene=motion&technique=path-tracer&render.max_depth=2&size=61x37&frames=4&seed=1&time=0.5&accumulate=yes';
  const words = ['--technique', 'path-tracer', '--set', 'render.max_depth=2', '--frames', '4', '--time', '0.5', '--accumulate', 'yes'];
  const [here, there] = await compared(context, query, '(viewer) => viewer.frames() === 4', words);
  assert.deepEqual(here.attributes, there.attributes);
  for (const name of ['R', 'albedo.R', 'normal.Y', 'depth.Z']) assert.ok(values(here, name) > 3, `${name} is even`);
});

test('the EXR of a frame in motion has its motion', async (context) => {
  const words = ['--technique', 'normals', '--frames', '4', '--accumulate', 'no'];
  const [here] = await compared(context, '?scene=motion&technique=normals&size=61x37&frames=4&seed=1&accumulate=no', '(viewer) => Math.abs(viewer.time() - 3 / 60) < 1e-6', words);
  for (const name of ['motion.X', 'motion.Y']) assert.ok(values(here, name) > 100, `${name} is even`);
});
