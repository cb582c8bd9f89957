// npm run soak: a person who moves the camera and changes settings at random, for SOAK_MINUTES (30) with SOAK_SEED (1). It fails at the first
// value that is no number, the first lost device, and whatever the page or the console complain of beside contradictions.
import { openPage, openSite, waitForFrames } from './pages.mjs';

const minutes = Number(process.env.SOAK_MINUTES ?? 30);
let state = Number(process.env.SOAK_SEED ?? 1) >>> 0;

/** Mulberry32: 0 to 1. */
function random() {
  state = (state + 0x6d2b79f5) >>> 0;
  let bits = Math.imul(state ^ (state >>> 15), state | 1);
  bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
  return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
}

const pick = (list) => list[Math.floor(random() * list.length)];

/** A value that a field takes: any choice, or a number of its range, small ones as often as large ones. */
function valueFor({ kind, min, max, choices }) {
  if (kind === 'choice') return pick(choices);
  if (kind === 'bool') return String(random() < 0.5);
  const value = min > 0 ? min * (max / min) ** random() : min + (max - min) * random() ** 3;
  return String(kind === 'u32' ? Math.round(value) : value);
}

const site = await openSite();
const { page, problems } = await openPage(site, '?scene=cornell&size=24x16');
const done = {};
let what = 'the start';
try {
  await waitForFrames(page, 1);
  const { techniques, render } = await page.evaluate(async () => JSON.parse((await import(new URL('pkg/restir.js', location.href).href)).describe()));
  const actions = {
    async technique() {
      await page.select('#technique', pick(techniques).id);
    },
    async scene() {
      await page.select('#scene', pick(['cornell', 'cornell-64', 'veach-mis', 'glossy-spheres', 'area-lights', 'motion', 'switching']));
    },
    async parameter() {
      const shown = await page.$eval('#technique', (menu) => menu.value);
      // Faults are there to make values that are no numbers.
      const own = techniques.find(({ id }) => id === shown).params.filter(({ name }) => !name.startsWith('fault_'));
      const parameter = pick([...own, ...own, ...render.params.map((param) => ({ ...param, name: `render.${param.name}` }))]);
      const text = valueFor(parameter);
      what = `${shown} ${parameter.name}=${text}`;
      await page.$eval(
        `[id="parameter-${parameter.name}"]`,
        (field, to) => {
          if (field.type === 'checkbox') field.checked = to === 'true';
          else field.value = to;
          field.dispatchEvent(new Event('change'));
        },
        text,
      );
    },
    async drag() {
      await page.mouse.move(50 + 200 * random(), 50 + 200 * random());
      const button = pick(['left', 'right']);
      await page.mouse.down({ button });
      await page.mouse.move(50 + 200 * random(), 50 + 200 * random(), { steps: 3 });
      await page.mouse.up({ button });
    },
    async wheel() {
      await page.mouse.wheel({ deltaY: 300 * (random() - 0.5) });
    },
    async resize() {
      await page.evaluate((width, height) => window.restir.call((viewer) => viewer.resize(width, height)), 1 + Math.floor(40 * random()), 1 + Math.floor(30 * random()));
    },
  };
  const names = ['parameter', 'parameter', 'parameter', 'drag', 'drag', 'wheel', 'resize', 'technique', 'technique', 'scene'];
  const end = Date.now() + 60_000 * minutes;
  while (Date.now() < end) {
    const name = pick(names);
    what = name;
    await actions[name]();
    done[name] = (done[name] ?? 0) + 1;
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    const told = await page.evaluate(async () => {
      await window.restir.call(() => undefined);
      const stats = JSON.parse(await window.restir.call((viewer) => viewer.stats()));
      const message = document.getElementById('message');
      const text = message.hidden ? '' : message.innerText;
      document.getElementById('message-close').click();
      return { ...stats, text };
    });
    if (told.nan + told.inf > 0) throw new Error(`${told.nan} NaN and ${told.inf} infinite values`);
    if (told.text && !/^(A value is out of range|This graphics adapter is too small)/.test(told.text)) throw new Error(told.text);
    if (problems.length > 0) throw new Error(problems.join('\n'));
  }
  console.log(`${minutes} minutes, seed ${process.env.SOAK_SEED ?? 1}: ${JSON.stringify(done)}`);
} catch (error) {
  console.error(`after ${JSON.stringify(done)}, at ${what}, in ${await page.evaluate(() => location.search).catch(() => '?')}:\n${error.message}`);
  process.exitCode = 1;
}
await site.close();
