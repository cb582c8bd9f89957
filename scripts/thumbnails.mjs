// Makes the pictures of the gallery anew, www/gallery/SCENE.webp, in some minutes without a GPU:
//
//     cargo build && node scripts/thumbnails.mjs [SCENE ...]
//
// The command line renders, and Chromium, which the browser tests need anyway, writes WebP.
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { launch } from '../tests/browser/browsers.mjs';
import { root, softwareEnvironment } from './environment.mjs';
import { run, script, step } from './run.mjs';

const program = join(root, 'target', 'debug', 'restir');
const env = softwareEnvironment();
const folder = join(root, 'www', 'gallery');

/** Rendered at twice the size of the picture, which averages four pixels. */
const [width, height] = [288, 192];
const common = ['--technique', 'restir-di', '--accumulate', 'yes', '--size', `${2 * width}x${2 * height}`];
/** Few large lights: light that has been about. Many small ones: what comes from them directly, which is clean after few frames. */
const global = ['--set', 'bsdf_samples=1', '--max-depth', '4', '--frames', '12'];
const direct = (exposure) => ['--max-depth', '1', '--frames', '8', '--set', `film.exposure=${exposure}`];
/** What scenes need besides: a size that is soon built, a moment at which there is something to see. */
const special = {
  'cornell-64': { options: direct(0.5) },
  'many-lights': { example: 'many-lights:1000', options: direct(0.3) },
  hall: { example: 'hall:10000', options: direct(0.3) },
  arcade: { options: direct(1.5) },
  city: { options: direct(1) },
  torches: { options: direct(0.5) },
  motion: { options: [...global, '--time', '0.9'] },
  switching: { options: [...direct(0.7), '--time', '0.9'] },
};

async function render({ name, example }, path) {
  const { example: smaller = example, options = global } = special[name] ?? {};
  await run([program, 'render', `builtin:${smaller}`, ...common, ...options, '--out', path], { env });
  return readFileSync(path).toString('base64');
}

/** The bytes of a PNG as those of a WebP of half its size, by a page of the browser. A pixel that outshines all around it is noise. */
async function toWebp(page, png) {
  const text = await page.evaluate(
    async (base64, wide, high) => {
      const image = Object.assign(new Image(), { src: `data:image/png;base64,${base64}` });
      await image.decode();
      const sheet = (width, height) => Object.assign(document.createElement('canvas'), { width, height });
      const large = sheet(image.naturalWidth, image.naturalHeight);
      const context = large.getContext('2d');
      context.drawImage(image, 0, 0);
      const { width, height } = large;
      const { data } = context.getImageData(0, 0, width, height);
      const out = new ImageData(Uint8ClampedArray.from(data), width, height);
      const light = (at) => data[at] + data[at + 1] + data[at + 2];
      for (let y = 1; y < height - 1; y++) {
        for (let x = 1; x < width - 1; x++) {
          const at = 4 * (y * width + x);
          const around = [-width - 1, -width, 1 - width, -1, 1, width - 1, width, width + 1].map((step) => at + 4 * step);
          const brightest = around.sort((a, b) => light(b) - light(a));
          // Two specks may stand side by side.
          if (light(at) > light(brightest[1])) out.data.set(data.subarray(brightest[3], brightest[3] + 3), at);
        }
      }
      context.putImageData(out, 0, 0);
      const small = sheet(wide, high);
      const target = small.getContext('2d');
      target.imageSmoothingQuality = 'high';
      target.drawImage(large, 0, 0, wide, high);
      return small.toDataURL('image/webp', 0.85).split(',')[1];
    },
    png,
    width,
    height,
  );
  return Buffer.from(text, 'base64');
}

await script(async () => {
  const scenes = JSON.parse(await run([program, 'scenes', '--json'], { env }));
  const wanted = process.argv.slice(2);
  mkdirSync(folder, { recursive: true });
  const work = mkdtempSync(join(tmpdir(), 'restir-gallery-'));
  const { browser, close } = await launch();
  try {
    const page = await browser.newPage();
    for (const scene of scenes.filter(({ name }) => wanted.length === 0 || wanted.includes(name))) {
      await step(scene.name, async () => {
        const bytes = await toWebp(page, await render(scene, join(work, `${scene.name}.png`)));
        writeFileSync(join(folder, `${scene.name}.webp`), bytes);
        return `${(bytes.length / 1000).toFixed(1)} KB`;
      });
    }
  } finally {
    await close();
    rmSync(work, { recursive: true, force: true });
  }
});
