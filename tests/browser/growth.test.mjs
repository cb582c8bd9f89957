// Scenes and sizes come and go without a trace: memory of the GPU, of JavaScript and of the wasm module does not grow with their number.
// 20 switches and 10 sizes; 200 and 50 where RESTIR_GROWTH is set.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { browserName } from './browsers.mjs';
import { assertNoProblems, openPage, openSite, waitForFrames } from './pages.mjs';

const [switches, sizes] = process.env.RESTIR_GROWTH ? [200, 50] : [20, 10];
const scenes = ['veach-mis', 'area-lights', 'cornell-64', 'furnace', 'cornell'];

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Counts bytes of buffers and textures that live: made, and neither destroyed nor collected as garbage. */
const count = () => {
  window.live = { bytes: 0, most: 0, objects: 0, collected: 0 };
  const sizes = new WeakMap();
  const forget = ({ bytes }) => {
    window.live.bytes -= bytes;
    window.live.objects -= 1;
  };
  const registry = new FinalizationRegistry((entry) => {
    window.live.collected += 1;
    forget(entry);
  });
  const keep = (object, bytes) => {
    const entry = { bytes };
    sizes.set(object, entry);
    registry.register(object, entry, object);
    window.live.bytes += bytes;
    window.live.most = Math.max(window.live.most, window.live.bytes);
    window.live.objects += 1;
    return object;
  };
  // Of the widest format in use; counted alike before and after, an estimate will do.
  const bytesOf = ({ width, height, depthOrArrayLayers }) => width * height * depthOrArrayLayers * 16;
  for (const [name, bytes] of [['createBuffer', ({ size }) => size], ['createTexture', bytesOf]]) {
    const make = GPUDevice.prototype[name];
    GPUDevice.prototype[name] = function (description) {
      const made = make.call(this, description);
      return keep(made, bytes(name === 'createBuffer' ? description : made));
    };
  }
  for (const type of [GPUBuffer, GPUTexture]) {
    const { destroy } = type.prototype;
    type.prototype.destroy = function () {
      const entry = sizes.get(this);
      if (entry) {
        sizes.delete(this);
        registry.unregister(this);
        forget(entry);
      }
      return destroy.call(this);
    };
  }
};

/** Bytes in use once the garbage is collected: on the GPU, in the heap, and in the module. */
async function measure(page, client) {
  // What is collected may let go of more.
  for (let round = 0; round < 3; round++) {
    await client.send('HeapProfiler.collectGarbage');
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 100)));
  }
  const { usedSize } = await client.send('Runtime.getHeapUsage');
  const { wasm, gpu, most, objects, collected } = await page.evaluate(async () => {
    const { default: start } = await import(new URL('pkg/restir.js', location.href).href);
    return { wasm: (await start()).memory.buffer.byteLength, gpu: window.live.bytes, most: window.live.most, objects: window.live.objects, collected: window.live.collected };
  });
  return { gpu, most, objects, collected, heap: usedSize, wasm };
}

const told = ({ gpu, most, objects, collected, heap, wasm }) =>
  `GPU ${(gpu / 1e6).toFixed(3)} MB, at most ${(most / 1e6).toFixed(1)} MB, in ${objects} buffers and textures (${collected} left to the garbage collector), heap ${(heap / 1e6).toFixed(2)} MB, wasm ${(wasm / 1e6).toFixed(2)} MB`;

async function show(page, scene) {
  await page.select('#scene', scene);
  await page.waitForFunction((name) => (new URLSearchParams(location.search).get('scene') ?? 'cornell') === name, { polling: 20 }, scene);
  await waitForFrames(page, 1);
}

async function resize(page, width, height) {
  await page.evaluate((w, h) => window.restir.call((viewer) => viewer.resize(w, h)), width, height);
  await page.click('#reset');
  await waitForFrames(page, 1);
}

// Firefox neither tells of its heap nor collects on demand.
test(`memory does not grow over ${switches} scenes and ${sizes} sizes`, { skip: browserName !== 'chromium' }, async () => {
  const { page, problems } = await openPage(site, '?scene=cornell&technique=path-tracer&size=48x32&frames=2', count);
  const client = await page.createCDPSession();
  await waitForFrames(page, 2);
  const round = async () => {
    for (let at = 0; at < switches / 2; at++) await show(page, scenes[at % scenes.length]);
    for (let at = 0; at < sizes / 2; at++) await resize(page, 32 + 8 * (at % 5), 24 + 8 * (at % 4));
    await show(page, 'veach-mis');
    await show(page, 'cornell');
    await resize(page, 48, 32);
    const now = await measure(page, client);
    console.log(told(now));
    return now;
  };
  console.log(told(await measure(page, client)));
  // The first round makes what is kept: pipelines, code that is compiled when it is first run.
  const first = await round();
  const second = await round();
  // Counters are read back every half second: a few small buffers may be on their way.
  assert.ok(second.gpu - first.gpu < 4096 && second.objects - first.objects < 5, `on the GPU: ${told(first)}, then ${told(second)}`);
  assert.equal(second.wasm, first.wasm, 'bytes of the wasm module');
  assert.ok(second.heap - first.heap < 20_000 * (switches / 2 + sizes / 2), `the heap grew by ${second.heap - first.heap} bytes`);

  // What is not let go of is seen.
  await page.evaluate(() => window.restir.call(async () => {
    window.leak = (await (await navigator.gpu.requestAdapter()).requestDevice()).createBuffer({ size: 1e6, usage: GPUBufferUsage.STORAGE });
  }));
  assert.ok((await measure(page, client)).gpu > second.gpu + 1e6 - 4096);
  assertNoProblems(problems);
  await page.close();
});
