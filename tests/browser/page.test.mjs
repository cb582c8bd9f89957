// The page in a real browser: it boots, shows the picture that the command line renders, and says what is wrong.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { renderNatively } from './native.mjs';
import { assertNoProblems, contrast, openPage, openSite, readDisplay, waitForFrames, waitForMessage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Runs `work` on the page opened with `query`; it must end without a problem on the console. */
async function withPage(query, work, prepare) {
  const { page, problems } = await openPage(site, query, prepare);
  try {
    await work(page);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
}

// Two drivers never agree in every bit: a ray that grazes an edge takes another path. Nearly all values must agree to
// within a rounding step of the display, and what differs must not shift the mean. Measured: Firefox, whose driver is
// the command line's, agrees in every byte; Chromium on SwiftShader in 99.9 % of them, with a mean off by 0.005.
const closeBytes = 2;
const closeShare = 0.995;
const meanDifference = 0.1;

function assertSamePicture(actual, expected) {
  assert.equal(actual.length, expected.length);
  let [close, signed] = [0, 0];
  for (const [at, value] of actual.entries()) {
    if (Math.abs(value - expected[at]) <= closeBytes) close += 1;
    signed += value - expected[at];
  }
  const [share, shift] = [close / actual.length, signed / actual.length];
  assert.ok(share >= closeShare, `${(100 * share).toFixed(2)} % of the values agree within ${closeBytes}`);
  assert.ok(Math.abs(shift) <= meanDifference, `the mean is off by ${shift.toFixed(2)}`);
}

for (const technique of ['path-tracer', 'restir-di']) {
  test(`${technique}: the displayed pixels are those of the command line`, () =>
    withPage(`?scene=cornell&technique=${technique}&size=64x48&frames=4&seed=1`, async (page) => {
      await waitForFrames(page, 4);
      const picture = await readDisplay(page);
      assert.ok(contrast(picture, 64, 48) > 40, 'the picture is flat');
      const options = ['--technique', technique, '--size', '64x48', '--frames', '4', '--seed', '1'];
      const native = await renderNatively('builtin:cornell', options);
      assertSamePicture(picture, native.rgb);
    }));
}

test('switches scene, technique and size, and keeps the address up to date', () =>
  withPage('?scene=cornell&technique=normals&size=32x32&frames=2', async (page) => {
    await waitForFrames(page, 2);
    const normals = await readDisplay(page);

    await page.select('#technique', 'path-tracer');
    await page.waitForFunction(() => location.search.includes('technique=path-tracer'), { polling: 50 });
    await waitForFrames(page, 2);
    const paths = await readDisplay(page);
    assert.notDeepEqual(paths, normals);

    await page.select('#scene', 'furnace');
    await page.waitForFunction(() => location.search.includes('scene=furnace'), { polling: 50 });
    await waitForFrames(page, 2);
    assert.notDeepEqual(await readDisplay(page), paths);

    await page.evaluate(() => window.restir.call((viewer) => viewer.resize(48, 24)));
    await page.click('#reset');
    await waitForFrames(page, 1);
    assert.equal((await readDisplay(page)).length, 48 * 24 * 3);
  }));

for (const fault of [false, true]) {
  test(`samples that are not numbers are ${fault ? 'counted on screen' : 'not there, and not mentioned'}`, () =>
    withPage(
      `?scene=cornell-64&technique=restir-report&configuration=e-both&fault_unguarded_pdf=${fault}&size=64x64&frames=1`,
      async (page) => {
        // The counters are read back after the frame.
        await page.waitForFunction(() => document.querySelector('#status').textContent.includes('rays/s'), { polling: 50 });
        const count = await page.$eval('#status', (status) => status.querySelector('strong')?.textContent ?? '');
        assert.match(count, fault ? /^[1-9]\d* NaN/ : /^$/);
      },
    ));
}

test('another scene is chosen while the first one loads', () =>
  withPage('?scene=hall:1000000&technique=normals&size=24x16', async (page) => {
    await page.waitForFunction(() => document.querySelectorAll('#scene option').length > 3, { polling: 20 });
    await page.select('#scene', 'furnace');
    await waitForFrames(page, 1);
    await page.waitForFunction(() => location.search.includes('scene=furnace'), { polling: 50 });
    assert.ok(await page.$eval('#loading', (bar) => bar.hidden));
    assert.ok(await page.$eval('#message', (message) => message.hidden), 'nothing went wrong');
  }, () => {
    // So that the second scene is there before the first one's load has ended, which waits for the adapter.
    const { requestAdapter } = GPU.prototype;
    GPU.prototype.requestAdapter = async function (...given) {
      await new Promise((resolve) => setTimeout(resolve, 1500));
      return requestAdapter.apply(this, given);
    };
  }));

test('follows the window', () =>
  withPage('?scene=cornell&technique=normals&scale=0.25', async (page) => {
    await waitForFrames(page, 1);
    await page.setViewport({ width: 400, height: 200 });
    await page.waitForFunction(() => document.getElementById('status').textContent.includes('100×50'), { polling: 50 });
    assert.equal((await readDisplay(page)).length, 100 * 50 * 3);
  }));

test('a parameter in the panel changes the picture and the address', () =>
  withPage('?scene=cornell&technique=path-tracer&size=32x32&frames=1', async (page) => {
    await waitForFrames(page, 1);
    const bright = await readDisplay(page);
    const set = (text) =>
      page.evaluate((value) => {
        const input = document.getElementById('parameter-film.exposure');
        input.value = value;
        input.dispatchEvent(new Event('change'));
      }, text);
    await set('-4');
    await page.waitForFunction(() => location.search.includes('film.exposure=-4'), { polling: 50 });
    const dark = await readDisplay(page);
    const sum = (bytes) => bytes.reduce((total, byte) => total + byte, 0);
    assert.ok(sum(dark) < sum(bright) / 2);
    await set('0');
    await page.waitForFunction(() => !location.search.includes('exposure'), { polling: 50 });
    assert.deepEqual(await readDisplay(page), bright);
  }));

test('dragging orbits, and pausing stops', () =>
  withPage('?scene=cornell&technique=normals&size=32x32', async (page) => {
    await waitForFrames(page, 1);
    await page.click('#pause');
    const still = await readDisplay(page);
    const frames = () => page.evaluate(() => window.restir.call((viewer) => viewer.frames()));
    const before = await frames();
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 200)));
    assert.equal(await frames(), before);
    await page.mouse.move(100, 100);
    await page.mouse.down();
    await page.mouse.move(160, 120, { steps: 3 });
    await page.mouse.up();
    await page.waitForFunction(() => location.search.includes('pose='), { polling: 50 });
    assert.notDeepEqual(await readDisplay(page), still);
  }));

test('a key that is tapped between two frames turns the camera', () =>
  withPage('?scene=cornell&technique=normals&size=16x16&frames=1', async (page) => {
    await waitForFrames(page, 1);
    await page.evaluate(() => {
      for (const type of ['keydown', 'keyup']) document.getElementById('canvas').dispatchEvent(new KeyboardEvent(type, { code: 'ArrowLeft', key: 'ArrowLeft', bubbles: true, cancelable: true }));
    });
    await page.waitForFunction(() => location.search.includes('pose='), { polling: 50 });
  }));

test('time runs, stops and can be scrubbed, and the address keeps the moment', () =>
  withPage('?scene=motion&technique=normals&size=48x32&time=1', async (page) => {
    await waitForFrames(page, 1);
    const time = () => page.evaluate(() => window.restir.call((viewer) => viewer.time()));
    const until = async (what, test) => {
      for (let tries = 0; tries < 600; tries++) {
        if (await test()) return;
        await new Promise((resolve) => setTimeout(resolve, 50));
      }
      assert.fail(what);
    };
    assert.equal(await page.evaluate(() => document.getElementById('play').getAttribute('aria-pressed')), 'true', 'a scene that moves is played');
    assert.ok((await time()) >= 1);
    const first = await time();
    await until('time runs', async () => (await time()) > first + 0.05);

    // Stopped: frames are averaged, and the moment is in the address.
    await page.click('#play');
    await page.waitForFunction(() => /time=1\.\d/.test(location.search) && location.search.includes('accumulate=yes'), { polling: 50 });
    const stopped = await time();
    await waitForFrames(page, 3);
    assert.equal(await time(), stopped);

    // The slider is reached by keyboard.
    await page.focus('#scrub');
    await page.keyboard.press('Home');
    await until('the slider goes to the start', async () => (await time()) === 0);
    await waitForFrames(page, 1);
    const start = await readDisplay(page);
    await page.keyboard.press('End');
    await page.keyboard.press('ArrowLeft');
    await until('and back from the end', async () => Math.abs((await time()) - 3.99) < 1e-6);
    await waitForFrames(page, 1);
    assert.notDeepEqual(await readDisplay(page), start);

    // A camera that moves is followed from moment to moment.
    const camera = () => page.evaluate(() => window.restir.call((viewer) => viewer.camera()));
    await page.select('#camera', '1');
    await page.waitForFunction(() => location.search.includes('camera=1'), { polling: 50 });
    await page.evaluate(() => window.restir.call((viewer) => viewer.set_time(1)));
    await waitForFrames(page, 1);
    const before = await camera();
    await page.click('#play');
    await until('the camera moves', async () => (await camera()) !== before);
  }));

test('an unknown key in the address is a warning, and the picture appears', () =>
  withPage('?scene=cornell&technique=normals&size=16x16&frames=1&candidatez=3', async (page) => {
    await waitForFrames(page, 1);
    const warnings = await page.evaluate(() => document.getElementById('warnings').textContent);
    assert.match(warnings, /1 warning/);
    assert.match(warnings, /candidatez/);
  }));

/** Drops one file on the page, as a person would. */
const drop = (page, name, text) =>
  page.evaluate(
    (fileName, content) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([content], fileName));
      document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    },
    name,
    text,
  );

test('a broken .glb is named, and the former scene stays', () =>
  withPage('?scene=cornell&technique=normals&size=16x16&frames=1', async (page) => {
    await waitForFrames(page, 1);
    const before = await readDisplay(page);
    await drop(page, 'broken.glb', 'this is no glTF');
    const message = await waitForMessage(page);
    assert.match(message, /broken\.glb/);
    await page.click('#message-close');
    assert.deepEqual(await readDisplay(page), before);
  }));

const triangle = {
  asset: { version: '2.0' },
  scenes: [{ nodes: [0] }],
  nodes: [{ mesh: 0 }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
  buffers: [{ byteLength: 36, uri: `data:application/octet-stream;base64,${Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer).toString('base64')}` }],
  bufferViews: [{ buffer: 0, byteLength: 36 }],
  accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
};

test('a dropped .gltf is shown', () =>
  withPage('?scene=cornell&technique=normals&size=16x16&frames=1', async (page) => {
    await waitForFrames(page, 1);
    const before = await readDisplay(page);
    await drop(page, 'triangle.gltf', JSON.stringify(triangle));
    await page.waitForFunction(() => document.getElementById('scene').value === 'triangle.gltf', { polling: 50 });
    await waitForFrames(page, 1);
    assert.notDeepEqual(await readDisplay(page), before);
  }));

/** A Radiance file of one row of texels, each of this RGBE. */
const radiance = (...texels) => [...Buffer.from(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X ${texels.length}\n`), ...texels.flat()];

/** Drops a file of bytes. */
const dropBytes = (page, name, bytes) =>
  page.evaluate(
    (fileName, content) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([Uint8Array.from(content)], fileName));
      document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    },
    name,
    bytes,
  );

const chosenEnvironment = (page, text) =>
  page.waitForFunction((wanted) => document.getElementById('environment').value === wanted, { polling: 50 }, text);

test('sun and sky by the address are those of the command line', () =>
  withPage('?scene=glossy-spheres&environment=sky:elevation=20,azimuth=160&technique=path-tracer&size=64x48&frames=2', async (page) => {
    await waitForFrames(page, 2);
    const options = ['--environment', 'sky:elevation=20,azimuth=160', '--technique', 'path-tracer', '--size', '64x48', '--frames', '2'];
    const native = await renderNatively('builtin:glossy-spheres', options);
    assertSamePicture(await readDisplay(page), native.rgb);
    assert.equal(new URL(page.url()).searchParams.get('environment'), 'sky:elevation=20,azimuth=160');
  }));

test('a dropped environment map lights the scene that is shown, and the menu takes it away again', () =>
  withPage('?scene=furnace&technique=path-tracer&size=16x16&frames=1', async (page) => {
    await waitForFrames(page, 1);
    const before = await readDisplay(page);
    await dropBytes(page, 'red.hdr', radiance([128, 0, 0, 128], [128, 0, 0, 128]));
    await chosenEnvironment(page, 'red.hdr');
    await waitForFrames(page, 1);
    const red = await readDisplay(page);
    assert.ok(red.every((value, at) => at % 3 === 0 || value < 40) && red.some((value) => value > 100), 'all is red');
    assert.equal(await page.evaluate(() => document.getElementById('scene').value), 'furnace');

    await dropBytes(page, 'broken.exr', [1, 2, 3]);
    assert.match(await waitForMessage(page), /broken\.exr/);
    await page.click('#message-close');
    assert.deepEqual(await readDisplay(page), red);

    await page.select('#environment', '');
    // The menu says so at once; the picture follows when the scene has been read again.
    const deadline = Date.now() + 20_000;
    let after = red;
    while (Date.now() < deadline && after[0] !== before[0]) after = await readDisplay(page);
    assert.deepEqual(after, before);
    await page.select('#environment', 'sky');
    await page.waitForFunction(() => location.search.includes('environment=sky'), { polling: 50 });
  }));

test('an environment map by its address', () => {
  const map = `data:application/octet-stream;base64,${Buffer.from(radiance([0, 128, 0, 128], [0, 128, 0, 128])).toString('base64')}`;
  return withPage(`?scene=furnace&technique=path-tracer&size=16x16&frames=1&environment=${encodeURIComponent(map)}`, async (page) => {
    await waitForFrames(page, 1);
    const green = await readDisplay(page);
    assert.ok(green.every((value, at) => at % 3 === 1 || value < 40) && green.some((value) => value > 100), 'all is green');
  });
});

test('an environment that is not there is named, and the scene is shown without it', async () => {
  const { page } = await openPage(site, '?scene=cornell&technique=normals&size=16x16&frames=1&environment=missing.hdr');
  await page.waitForFunction(async () => (await window.restir.call((viewer) => viewer.frames())) >= 1, { polling: 100 });
  assert.match(await waitForMessage(page), /missing\.hdr: the server says 404/);
  await page.close();
});

test('something that is no scene is refused in words', () =>
  withPage('?scene=cornell&technique=normals&size=16x16&frames=1', async (page) => {
    await waitForFrames(page, 1);
    await drop(page, 'notes.txt', 'hello');
    assert.match(await waitForMessage(page), /notes\.txt is neither/);
  }));

test('what nobody has foreseen is told', async () => {
  const { page } = await openPage(site, '?scene=cornell&technique=normals&size=16x16&frames=1');
  try {
    await waitForFrames(page, 1);
    // In a script of the page's: what a test runs by itself is told without its words.
    for (const [name, text] of [['first', "setTimeout(() => { throw new Error('first fault'); })"], ['second', "void Promise.reject(new Error('second fault'))"]]) {
      await page.evaluate((code) => document.head.append(Object.assign(document.createElement('script'), { textContent: code })), text);
      await page.waitForFunction((wanted) => document.getElementById('message').innerText.includes(`${wanted} fault`), { polling: 50 }, name);
      await page.click('#message-close');
    }
  } finally {
    await page.close();
  }
});

test('a browser without WebGPU is told so', () =>
  withPage(
    '',
    async (page) => assert.match(await waitForMessage(page), /no WebGPU/),
    () => Object.defineProperty(Navigator.prototype, 'gpu', { value: undefined }),
  ));

test('a machine without an adapter is told so', () =>
  withPage(
    '',
    async (page) => assert.match(await waitForMessage(page), /No graphics adapter/),
    () => (GPU.prototype.requestAdapter = async () => null),
  ));
