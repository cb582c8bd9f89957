// What the page offers beside the picture: presets, search, keys, passes, saving and copying.
import { strict as assert } from 'node:assert';
import { after, before, test } from 'node:test';
import { compareNatively, renderNatively } from './native.mjs';
import { decodePng } from './png.mjs';
import { assertNoProblems, openPage, openSite, readDisplay, unfold, waitForFrames, waitForMessage, withPage } from './pages.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

/** Headless browsers have no clipboard of their own: what would be copied is kept. */
const keepCopies = () =>
  Object.defineProperty(navigator, 'clipboard', { value: { writeText: async (text) => void (window.copied = text) } });

const open = (query, work) => withPage(site, query, work, keepCopies);

const small = '?scene=cornell&size=24x16&frames=2';
const value = (page, selector) => page.$eval(selector, (element) => element.value);
/** Three bytes a pixel to four. */
const withAlpha = (rgb) => Uint8Array.from({ length: (rgb.length / 3) * 4 }, (_, at) => (at % 4 === 3 ? 255 : rgb[Math.floor(at / 4) * 3 + (at % 4)]));
const addressHas = (page, text) => page.waitForFunction((wanted) => location.search.includes(wanted), { polling: 50 }, text);

test('a preset sets technique and parameters, and is left when one of them changes', () =>
  open(small, async (page) => {
    assert.equal(await value(page, '#preset'), '');
    await page.select('#preset', 'wyman-2021-unbiased');
    await addressHas(page, 'visibility=mis');
    await waitForFrames(page, 2);
    assert.equal(await value(page, '#technique'), 'restir-di-decoupled');
    assert.equal(await value(page, '#parameter-visibility'), 'mis');
    assert.equal(await value(page, '#preset'), 'wyman-2021-unbiased');
    await page.select('#preset', 'lanz-2025');
    await addressHas(page, 'render.energy_compensation=true');
    await waitForFrames(page, 2);
    assert.ok(!(await page.evaluate(() => location.search)).includes('visibility=mis'));
    await page.select('#preset', 'bitterli-2020-unbiased');
    await addressHas(page, 'reuse_weights=1%2Fz'.replace('%2F', '/'));
    assert.ok(!(await page.evaluate(() => location.search)).includes('render.'), 'the former preset leaves nothing');
    await waitForFrames(page, 2);
    const picture = await readDisplay(page);
    const native = await renderNatively('builtin:cornell', ['--preset', 'bitterli-2020-unbiased', '--size', '24x16', '--frames', '2']);
    const close = picture.filter((byte, at) => Math.abs(byte - native.rgb[at]) <= 2).length;
    assert.ok(close / picture.length > 0.99, `${close} of ${picture.length} values are those of the command line's preset`);
    await page.select('#parameter-reuse_weights', 'balance');
    await page.waitForFunction(() => document.getElementById('preset').value === '', { polling: 50 });
  }));

test('a setting that contradicts another is refused in words, and shown as it was', () =>
  open('?scene=cornell&size=24x16&frames=1&technique=restir-di-decoupled&reuse_weights=heuristics', async (page) => {
    await page.select('#parameter-visibility', 'mis');
    assert.match(await waitForMessage(page), /mis.*heuristics|heuristics.*mis/s);
    assert.equal(await value(page, '#parameter-visibility'), 'decoupled');
    assert.ok(!(await page.evaluate(() => location.search)).includes('visibility'));
  }));

test('a link may say yes for true', () =>
  open(`${small}&spatial_feedback=yes&temporal_reuse=on`, async (page) => {
    assert.ok(await page.$eval('#parameter-spatial_feedback', (box) => box.checked));
    await addressHas(page, 'spatial_feedback=true');
    assert.ok(!(await page.evaluate(() => location.search)).includes('temporal_reuse'), 'that is the default');
  }));

test('settings are searched by name and by what they do', () =>
  open(small, async (page) => {
    const shown = () => page.$$eval('.parameter', (rows) => rows.filter((row) => row.offsetParent !== null).map((row) => row.querySelector('label').htmlFor));
    const all = (await shown()).length;
    await page.type('#search', 'same block of 4');
    assert.deepEqual(await shown(), ['parameter-temporal_permutation']);
    // What was looked for stays when the panel is made anew.
    await page.select('#technique', 'path-tracer');
    await addressHas(page, 'technique=path-tracer');
    assert.deepEqual(await shown(), []);
    await page.select('#technique', 'restir-di');
    await page.waitForFunction(() => document.querySelectorAll('.parameter:not([hidden])').length === 1, { polling: 50 });
    await page.$eval('#search', (search) => {
      search.value = '';
      search.dispatchEvent(new Event('input'));
    });
    assert.equal((await shown()).length, all);
  }));

test('? lists the keys, and Escape closes the list', () =>
  open(small, async (page) => {
    await page.focus('#canvas');
    await page.keyboard.type('?');
    assert.ok(await page.$eval('#help', (help) => help.open && help.innerText.includes('Wheel')));
    await page.keyboard.press('Escape');
    assert.ok(await page.$eval('#help', (help) => !help.open));
  }));

test('the page fills the screen and comes back, by button and by key', () =>
  open(small, async (page) => {
    await waitForFrames(page, 1);
    const fills = (wanted) =>
      page.waitForFunction(
        (on) => (document.fullscreenElement !== null) === on && document.getElementById('fullscreen').getAttribute('aria-pressed') === String(on),
        { polling: 50 },
        wanted,
      );
    await page.click('#fullscreen');
    await fills(true);
    await page.focus('#canvas');
    await page.keyboard.press('f');
    await fills(false);
    // Where it is refused that is said.
    await page.evaluate(() => (document.documentElement.requestFullscreen = () => Promise.reject(new Error('not here'))));
    await page.click('#fullscreen');
    await page.waitForFunction(() => document.getElementById('message').innerText.includes('not here'), { polling: 50 });
  }));

test('passes are listed with their times, or it is said that they cannot be', () =>
  open('?scene=cornell&size=24x16', async (page) => {
    await unfold(page, 'timing');
    // The first frame has no temporal pass.
    await waitForFrames(page, 3);
    const passes = await page.evaluate(async () => JSON.parse(await window.restir.call((viewer) => viewer.stats())).passes.map(({ name }) => name));
    const told = passes.length > 0 ? [...passes, 'scene/visibility'] : ['does not tell'];
    const all = (wanted) => wanted.every((word) => document.getElementById('passes').innerText.includes(word));
    await page.waitForFunction(all, { polling: 50 }, told);
  }));

test('the picture is saved, a link copied that shows it, and a command line that renders it', () =>
  open(`${small}&technique=normals&render.pixel_filter=center&seed=5`, async (page) => {
    await page.evaluate(() => {
      HTMLAnchorElement.prototype.click = function () {
        window.saved = fetch(this.href).then(async (file) => ({ name: this.download, bytes: [...new Uint8Array(await file.arrayBuffer())] }));
      };
    });
    await waitForFrames(page, 2);
    const picture = await readDisplay(page);
    await page.click('#save');
    const saved = await page.waitForFunction(() => window.saved, { polling: 50 }).then((handle) => handle.jsonValue());
    assert.equal(saved.name, 'cornell-normals.png');
    assert.deepEqual(saved.bytes.slice(0, 4), [0x89, 0x50, 0x4e, 0x47]);

    await page.click('#copy-link');
    const link = await page.waitForFunction(() => window.copied, { polling: 50 }).then((handle) => handle.jsonValue());
    const other = await openPage(site, new URL(link).search);
    await waitForFrames(other.page, 2);
    assert.deepEqual(await readDisplay(other.page), picture);
    await other.page.close();

    await page.evaluate(() => (window.copied = undefined));
    await page.click('#copy-command');
    const command = await page.waitForFunction(() => window.copied, { polling: 50 }).then((handle) => handle.jsonValue());
    assert.equal(command, 'restir render builtin:cornell --technique normals --set render.pixel_filter=center --size 24x16 --frames 2 --seed 5 --out picture.png');

    // A camera that was moved is in it as well. Without noise, for frames go on being counted when it moves.
    await page.evaluate(() => (window.copied = undefined));
    await page.mouse.move(100, 200);
    await page.mouse.down();
    await page.mouse.move(140, 210, { steps: 2 });
    await page.mouse.up();
    await addressHas(page, 'pose=');
    await waitForFrames(page, 2);
    const moved = await readDisplay(page);
    assert.notDeepEqual(moved, picture);
    await page.click('#copy-command');
    const posed = await page.waitForFunction(() => window.copied, { polling: 50 }).then((handle) => handle.jsonValue());
    const [pose] = /(?<=--pose )\S+/.exec(posed) ?? [];
    const native = await renderNatively('builtin:cornell', ['--technique', 'normals', '--set', 'render.pixel_filter=center', '--size', '24x16', '--frames', '2', '--seed', '5', '--pose', pose]);
    const close = moved.filter((byte, at) => Math.abs(byte - native.rgb[at]) <= 2).length;
    assert.ok(close / moved.length > 0.97, `${close} of ${moved.length} values are those of ${posed}`);
  }));

test('errors against a reference are those of the command line, are drawn, and end when the camera moves', () =>
  open('?scene=cornell&technique=path-tracer&size=24x16&frames=64&render.max_depth=1', async (page) => {
    const told = () => page.$eval('#errors-table', (table) => table.innerText);
    await waitForFrames(page, 64);
    await unfold(page, 'errors');
    await page.click('#keep-reference');
    // The same frames again end at the picture itself.
    await page.waitForFunction(() => document.getElementById('errors-table').innerText.includes('0.00e+0'), { polling: 50 });
    await page.select('#technique', 'ris');
    await addressHas(page, 'technique=ris');
    await waitForFrames(page, 64);
    await page.evaluate(() => {
      HTMLAnchorElement.prototype.click = function () {
        window.saved = fetch(this.href).then((file) => file.text());
      };
    });
    const lastOf = (csv) => csv.trim().split('\n').at(-1).split(',');
    await page.waitForFunction(
      async () => {
        document.getElementById('errors-csv').click();
        return (await window.saved).trim().split('\n').at(-1).split(',')[1] === '64';
      },
      { polling: 200 },
    );
    const csv = await page.evaluate(() => window.saved);
    const [name, frames, milliseconds, mse, , , , , clock] = lastOf(csv);
    const passes = await page.evaluate(async () => JSON.parse(await window.restir.call((viewer) => viewer.stats())).passes.map(({ ms }) => ms));
    assert.equal(clock, passes.some((ms) => ms > 0) ? 'GPU' : 'page');
    assert.ok(Number(frames) === 64 && Number(milliseconds) > 0, lastOf(csv).join());
    assert.equal(name, '"ris render.max_depth=1"');
    assert.match(csv, /^series,frames,milliseconds,mse,relmse,mape,bias,flip,clock\n"path-tracer/);
    const common = ['--size', '24x16', '--frames', '64', '--set', 'render.max_depth=1'];
    const native = await compareNatively('builtin:cornell', [...common, '--technique', 'ris'], [...common, '--technique', 'path-tracer']);
    assert.ok(Math.abs(Number(mse) / native.mse - 1) < 0.05, `${mse} here, ${native.mse} there`);
    assert.match(await told(), /MSE\s+\d\.\d\de-\d/);
    assert.equal(await page.$$eval('#errors-plot polyline', (lines) => lines.length), 2);

    // Above what the errors cover.
    await page.mouse.move(100, 20);
    await page.mouse.down();
    await page.mouse.move(140, 30, { steps: 2 });
    await page.mouse.up();
    await page.waitForFunction(() => document.getElementById('errors-words').innerText.includes('camera'), { polling: 50 });
    assert.equal(await told(), '');
  }));

test('a reference is of one view and one moment', () =>
  open('?scene=motion&technique=normals&render.pixel_filter=center&size=24x16&frames=4&accumulate=yes&time=0.5', async (page) => {
    const words = (part) => page.waitForFunction((wanted) => document.getElementById('errors-words').textContent.includes(wanted), { polling: 50 }, part);
    const measured = () => page.waitForFunction(() => document.getElementById('errors-table').innerText.includes('0.00e+0'), { polling: 50 });
    await waitForFrames(page, 4);
    await unfold(page, 'errors');
    await page.click('#keep-reference');
    await measured();
    await page.select('#difference', 'flip');
    await page.waitForFunction(() => document.getElementById('difference-words').textContent.includes('mean 0.0000'), { polling: 50 });
    await page.select('#view', 'albedo');
    await words('The reference shows radiance, picture A albedo');
    assert.equal(await page.$eval('#errors-table', (table) => table.innerText), '');
    await page.waitForFunction(() => document.getElementById('difference-words').textContent.includes('shows albedo'), { polling: 50 });
    await page.select('#view', 'radiance');
    await page.waitForFunction(() => document.getElementById('errors-words').textContent === '', { polling: 50 });
    await measured();
    await page.$eval('#scrub', (slider) => {
      slider.value = '0.75';
      slider.dispatchEvent(new Event('input'));
    });
    await words('keep a new reference');
    // Another technique and back again ends none; a resolution of one's own does, and is taken.
    await waitForFrames(page, 4);
    await page.click('#keep-reference');
    await measured();
    await page.select('#technique', 'ris');
    await addressHas(page, 'technique=ris');
    await waitForFrames(page, 4);
    await page.goBack();
    await addressHas(page, 'technique=normals');
    await measured();
    await page.select('#scale', '0.5');
    await words('keep a new reference');
    await page.waitForFunction(() => !location.search.includes('size='), { polling: 50 });
    assert.equal(await page.$eval('#errors-table', (table) => table.innerText), '');
  }));

test('what an address says of a second picture and cannot be is a warning, too', () =>
  open(`?scene=cornell&technique=normals&size=16x16&frames=1&b=${encodeURIComponent('technique=bogus&seed=x&film.exposure=loud&size=9x9')}`, async (page) => {
    await page.waitForFunction(() => document.querySelectorAll('#warnings li').length === 4, { polling: 50 });
    const told = await page.$$eval('#warnings li', (items) => items.map(({ textContent }) => textContent).sort());
    for (const [at, name] of ['film.exposure=loud', 'seed=x', 'size=9x9', 'technique=bogus'].entries()) assert.match(told[at], new RegExp(`^picture B: ${name} in the address: `));
  }));

test('two pictures side by side: their own settings, one camera, a divider, and a link that holds both', () =>
  open('?scene=cornell&technique=normals&size=24x16&frames=2&render.pixel_filter=center', async (page) => {
    const second = (tab) =>
      tab.evaluate(async () => btoa(String.fromCharCode(...(await window.restir.other((viewer) => viewer.read_display())))));
    const untilSecond = (tab, text) => tab.waitForFunction((wanted) => document.getElementById('label-b').textContent.includes(wanted), { polling: 50 }, text);
    const alone = await readDisplay(page);
    await page.click('#compare');
    await untilSecond(page, '2 frames');
    assert.equal(await value(page, '#target'), 'b');
    assert.equal(await second(page), Buffer.from(withAlpha(alone)).toString('base64'), 'it begins as the same picture');

    // The panel changes B alone.
    await page.select('#technique', 'ris');
    await addressHas(page, 'b=');
    await untilSecond(page, 'ris, 2 frames');
    assert.deepEqual(await readDisplay(page), alone);
    const other = await second(page);
    assert.notEqual(other, Buffer.from(withAlpha(alone)).toString('base64'));
    await page.select('#target', 'a');
    assert.equal(await value(page, '#technique'), 'normals');

    // What is seen: A left of the divider, B right of it.
    const row = async () => {
      const { rgb } = decodePng(Buffer.from(await page.screenshot({ clip: { x: 0, y: 200, width: 400, height: 1 } })));
      return (x) => [...rgb.subarray(3 * x, 3 * x + 3)].join();
    };
    const places = [150, 390];
    const shownAt = async () => places.map(await row());
    await page.focus('#divider');
    await page.keyboard.press('End');
    const onlyA = await shownAt();
    await page.keyboard.press('Home');
    const onlyB = await shownAt();
    assert.notEqual(onlyA[0], onlyB[0]);
    assert.notEqual(onlyA[1], onlyB[1]);
    await page.mouse.move(2, 200);
    await page.mouse.down();
    await page.mouse.move(270, 200, { steps: 3 });
    await page.mouse.up();
    assert.deepEqual(await shownAt(), [onlyA[0], onlyB[1]]);
    assert.equal(await page.$eval('#divider', (divider) => divider.ariaValueNow), '42');

    // One camera for both.
    await page.mouse.move(100, 250);
    await page.mouse.down();
    await page.mouse.move(140, 260, { steps: 2 });
    await page.mouse.up();
    await addressHas(page, 'pose=');
    await waitForFrames(page, 2);
    await untilSecond(page, '2 frames');
    const cameras = await page.evaluate(async () => [
      await window.restir.call((viewer) => viewer.camera()),
      await window.restir.other((viewer) => viewer.camera()),
    ]);
    assert.equal(cameras[0], cameras[1]);

    const link = await page.evaluate(() => location.search);
    const copy = await openPage(site, link);
    await untilSecond(copy.page, 'ris, 2 frames');
    assert.deepEqual(await copy.page.evaluate(() => window.restir.call((viewer) => viewer.camera())).then((text) => JSON.parse(text).name), JSON.parse(cameras[0]).name);
    assertNoProblems(copy.problems);
    await copy.page.close();

    await page.click('#compare');
    await page.waitForFunction(() => !location.search.includes('b='), { polling: 50 });
    assert.equal(await page.$('#canvas-b'), null);
  }));

test('links and commands say all that determines a picture', async () => {
  const { readQuery, writeQuery } = await import(new URL('../../dist/url-state.js', import.meta.url));
  const { commandLine } = await import(new URL('../../dist/command.js', import.meta.url));
  const query =
    '?scene=https://example.org/a/car.glb&scene-index=1&variant=midnight+blue&environment=sky:elevation=6&technique=ris&view=normal&seed=7' +
    '&accumulate=no&lights=5&time=1.5&speed=2&animation=walk&camera=2&pose=0,1,2,0,0,-1,0,1,0&size=64x48&scale=0.5&frames=9&candidates=3';
  const { state, unread } = readQuery(query);
  assert.deepEqual(unread, []);
  assert.equal(writeQuery(state), query);
  assert.equal(
    commandLine(state, 'car.glb', 2.25, [64, 48], 9),
    "restir render car.glb --scene-index 1 --variant 'midnight blue' --technique ris --set candidates=3 --size 64x48 --frames 9 --seed 7 " +
      '--environment sky:elevation=6 --lights 5 --time 2.25 --animation walk --pose 0,1,2,0,0,-1,0,1,0 --view normal --accumulate no --out picture.png',
  );
  assert.deepEqual(readQuery('?scene-index=x&size=9000x9&time=2e9&speed=-1e7').unread.length, 4);
});

/** The colour of a pixel of a canvas-sized picture of RGBA bytes, as #rrggbb. */
const hex = (bytes, at) => `#${[0, 1, 2].map((channel) => bytes[4 * at + channel].toString(16).padStart(2, '0')).join('')}`;

test('a view of a number has a legend with its colours and ends, which can be fitted to the picture', () =>
  open(`${small}&technique=restir-di`, async (page) => {
    const words = () => page.$eval('#legend', (element) => element.innerText);
    assert.equal(await page.$eval('#legend', (element) => element.hidden), true, 'the picture has none');
    await page.select('#view', 'motion');
    await page.waitForFunction(() => /grey at rest/.test(document.getElementById('legend').innerText), { polling: 50 });
    assert.equal(await page.$eval('#legend-scale', (element) => element.hidden), true, 'colours that mean something have no ends');
    await page.select('#view', 'BVH steps');
    await page.waitForFunction(() => document.getElementById('legend-high').textContent === '1024', { polling: 50 });
    assert.match(await words(), /nodes/);
    // The whole picture: one more frame averaged brings the ends together.
    await waitForFrames(page, 2);
    // The fit: the ends become those of the picture, are in the panel and the address, and colours reach from the first to the last.
    await page.click('#legend-fit');
    await page.waitForFunction(() => document.getElementById('legend-high').textContent !== '1024', { polling: 50 });
    const [low, high] = await page.$$eval('#legend-low, #legend-high', (ends) => ends.map(({ textContent }) => Number(textContent)));
    assert.ok(low > 0 && low < high && high < 1024, `${low} to ${high}`);
    assert.equal(await page.$eval('[id="parameter-film.range_high"]', (input) => Number(input.value)), high);
    await page.waitForFunction((end) => new URLSearchParams(location.search).get('film.range_high') === String(end), { polling: 50 }, high);
    const shown = await readDisplay(page);
    const colors = new Set(Array.from({ length: shown.length / 4 }, (_, at) => hex(shown, at)));
    assert.ok(colors.has('#440154') && colors.has('#fde725'), 'both ends of viridis are in the picture');
    await page.select('[id="parameter-film.color_map"]', 'magma');
    await page.waitForFunction(() => document.getElementById('legend-bar').style.background.includes('rgb(252, 253, 191)'), { polling: 50 });
    // Another view has another range.
    await page.select('#view', 'depth');
    await page.waitForFunction(() => document.getElementById('legend-low').textContent === '0' && !location.search.includes('range_'), { polling: 50 });
    await page.select('#view', 'BVH steps');
    await page.waitForFunction(() => document.getElementById('legend-high').textContent === '1024', { polling: 50 });
    await page.click('#legend-fit');
    await page.waitForFunction(() => document.getElementById('legend-high').textContent !== '1024', { polling: 50 });
    await page.click('#legend-own');
    await page.waitForFunction(() => document.getElementById('legend-high').textContent === '1024', { polling: 50 });
    assert.equal(await page.$eval('#legend-own', (button) => button.disabled), true);
    await page.select('#view', 'radiance');
    await page.waitForFunction(() => document.getElementById('legend').hidden, { polling: 50 });
    // The window that a furnace is: nothing to spread colours over.
    await page.select('#scene', 'furnace');
    await page.waitForFunction(() => location.search.includes('scene=furnace'), { polling: 50 });
    await waitForFrames(page, 1);
    await page.select('#view', 'not finite');
    await page.waitForFunction(() => !document.getElementById('legend').hidden, { polling: 50 });
    await waitForFrames(page, 1);
    await page.click('#legend-fit');
    await page.waitForFunction(() => /alike/.test(document.getElementById('legend').innerText), { polling: 50 });
  }));
