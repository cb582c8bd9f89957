// npm run rival: paths a second of the page and of three-gpu-pathtracer, on the same scene in the same browser, in turns.
// RIVAL_SECONDS (20) for each turn, RIVAL_SIZE (320x240); pictures of both in RIVAL_PICTURES, where it names a folder. RIVAL_BATCH (1) samples are given
// to the device before it is waited for: on a GPU a sample takes less time than to wait for it.
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { root } from '../../scripts/environment.mjs';
import { serve } from '../../scripts/serve.mjs';
import { openPage, openSite, waitForFrames } from './pages.mjs';

const seconds = Number(process.env.RIVAL_SECONDS ?? 20);
const folder = process.env.RIVAL_PICTURES;
const [width, height] = (process.env.RIVAL_SIZE ?? '320x240').split('x').map(Number);
const depth = 4;
const batch = Number(process.env.RIVAL_BATCH ?? 1);

/** Measures the rival: started and looked after, for one sample may take longer than the browser protocol waits. */
async function measureRival(page, wanted) {
  await page.evaluate((wait) => {
    window.result = undefined;
    void window.measure(wait).then((result) => (window.result = result));
  }, wanted);
  return page.waitForFunction(() => window.result, { polling: 200, timeout: 0 }).then((handle) => handle.jsonValue());
}

const save = (name, address) => folder && writeFileSync(join(folder, `${name}.png`), Buffer.from(address.split(',')[1], 'base64'));

const site = await openSite();
const server = await serve(root, 0);

/** Each turn has a page of its own, closed after it: nothing else is rendered meanwhile. */
const turns = {
  async ours() {
    const { page } = await openPage(site, `?scene=cornell&technique=path-tracer&size=${width}x${height}&render.max_depth=${depth}&film.tone_map=linear`);
    await waitForFrames(page, 3);
    // Frame after frame in one call, for the page's own loop renders one for each that the screen shows.
    await page.evaluate((wait, many) => {
      window.result = undefined;
      const measure = async (viewer) => {
        const [frames, start] = [viewer.frames(), performance.now()];
        while (performance.now() - start < wait) {
          for (let sample = 0; sample < many; sample++) {
            viewer.begin();
            viewer.finish();
          }
          await viewer.idle();
        }
        return { samples: viewer.frames() - frames, milliseconds: performance.now() - start };
      };
      void window.restir.call(measure).then((result) => (window.result = result));
    }, 1000 * seconds, batch);
    const result = await page.waitForFunction(() => window.result, { polling: 200, timeout: 0 }).then((handle) => handle.jsonValue());
    save('ours', await page.evaluate(async (...size) => {
      const canvas = document.createElement('canvas');
      const bytes = await window.restir.call((viewer) => viewer.read_display());
      Object.assign(canvas, { width: size[0], height: size[1] });
      canvas.getContext('2d').putImageData(new ImageData(Uint8ClampedArray.from(bytes), ...size), 0, 0);
      return canvas.toDataURL('image/png');
    }, width, height));
    await page.close();
    return result;
  },
  async theirs() {
    const { page } = await openPage({ browser: site.browser, url: server.url }, `tests/browser/rival.html?size=${width}x${height}&bounces=${depth}&batch=${batch}`);
    await page.waitForFunction(() => 'measure' in window, { polling: 50 });
    // Shaders are compiled, and first samples seen, before anything is measured.
    await measureRival(page, 1);
    const result = await measureRival(page, seconds);
    save('theirs', await page.evaluate(() => window.picture()));
    await page.close();
    return result;
  },
};

try {
  const rates = { ours: [], theirs: [] };
  for (const name of ['ours', 'theirs', 'ours', 'theirs']) {
    const { samples, milliseconds } = await turns[name]();
    const rate = (width * height * samples) / (milliseconds / 1000);
    rates[name].push(rate);
    console.log(`${name}: ${samples} samples a pixel in ${(milliseconds / 1000).toFixed(1)} s, ${(rate / 1000).toFixed(1)} thousand paths a second`);
  }
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  console.log(`ratio: ${(mean(rates.ours) / mean(rates.theirs)).toFixed(2)}`);
} finally {
  await Promise.all([site.close(), server.close()]);
}
