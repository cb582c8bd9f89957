// The tutorials in a real browser: the pages, the toys against their exact values, real clicks and keys, and life without WebGPU.
import { strict as assert } from 'node:assert';
import { readdirSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { assertNoProblems, openPage, openSite } from './pages.mjs';

const names = readdirSync(new URL('../../www/learn/', import.meta.url)).filter((name) => name.endsWith('.html'));

let site;
before(async () => (site = await openSite()));
after(() => site.close());

const removeGpu = () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined, configurable: true });

/** Runs `work` on a page; without WebGPU unless `live`, for toys need none and pictures take time. */
async function withPage(name, work, { live = false } = {}) {
  const { page, problems } = await openPage(site, `learn/${name}`, live ? undefined : removeGpu);
  try {
    await page.waitForFunction(() => document.readyState === 'complete', { polling: 50 });
    await work(page);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
}

const value = (page, selector) => page.$eval(selector, (element) => Number(element.dataset.value));
const text = (page, selector) => page.$eval(selector, (element) => element.textContent);
const until = (page, test, ...values) => page.waitForFunction(test, { polling: 50 }, ...values);
const untilRuns = (page, runs) => until(page, (wanted) => Number(document.getElementById('runs').dataset.value) === wanted, runs);

/** Puts a slider where it should be, by keys. */
async function press(page, selector, ...keys) {
  await page.focus(selector);
  for (const key of keys) await page.keyboard.press(key);
}

const within = (measured, exact, error, what) =>
  assert.ok(Math.abs(measured - exact) <= 4 * error, `${what}: ${measured} is ${((measured - exact) / error).toFixed(1)} standard errors from ${exact}`);

// Pages

test('there are pages, and each leads to the next and back', async () => {
  assert.ok(names.length >= 4);
  const visited = [];
  await withPage('index.html', async (page) => {
    const listed = await page.$$eval('ol a', (links) => links.map((link) => link.getAttribute('href')));
    assert.deepEqual([...listed, 'index.html'].sort(), [...names].sort());
    await Promise.all([page.waitForNavigation(), page.click('ol a')]);
    for (;;) {
      await page.waitForSelector('h1');
      visited.push(page.url().split('/').at(-1));
      const next = await page.$('a[rel=next]');
      if (!next) break;
      await Promise.all([page.waitForNavigation(), next.click()]);
    }
    assert.deepEqual(visited, listed);
    const back = listed.at(-2);
    await Promise.all([page.waitForNavigation(), page.click('a[rel=prev]')]);
    assert.equal(page.url().split('/').at(-1), back);
  });
});

for (const name of names) {
  test(`${name} fits 360 pixels, in light and dark, with its answer open`, () =>
    withPage(name, async (page) => {
      await page.setViewport({ width: 360, height: 740 });
      const grounds = [];
      for (const scheme of ['light', 'dark']) {
        // Firefox cannot emulate it; there the page is looked at once.
        await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]).catch(() => undefined);
        await page.$$eval('details', (all) => all.forEach((details) => (details.open = true)));
        await page.$$eval('button:not([id^=candidate])', (all) => all.forEach((button) => button.click()));
        const { wide, ground } = await page.evaluate(() => ({
          wide: document.documentElement.scrollWidth,
          ground: getComputedStyle(document.body).backgroundColor,
        }));
        assert.ok(wide <= 360, `the page is ${wide} pixels wide`);
        grounds.push(ground);
      }
      if ((process.env.BROWSER ?? 'chromium') === 'chromium') assert.notEqual(grounds[0], grounds[1]);
      const unnamed = await page.$$eval('input', (all) => all.filter((input) => !input.labels.length).map(({ id }) => id));
      assert.deepEqual(unnamed, [], 'sliders without a label');
      if (name !== 'index.html') {
        assert.ok((await page.$$('details')).length > 0 && (await page.$$('math')).length > 0);
      }
    }));

  if (name === 'index.html') continue;
  test(`${name} has still pictures and a sentence where WebGPU is missing`, () =>
    withPage(name, async (page) => {
      await until(page, () => [...document.querySelectorAll('.no-webgpu')].every(({ hidden }) => !hidden));
      assert.match(await text(page, '.no-webgpu'), /no WebGPU/);
      const pictures = await page.$$eval('restir-viewer', (all) =>
        all.map((viewer) => {
          const image = viewer.querySelector('img');
          return { live: viewer.shadowRoot !== null, wide: image.naturalWidth, shown: image.getBoundingClientRect().width, alt: image.alt };
        }),
      );
      assert.ok(pictures.length > 0);
      for (const { live, wide, shown, alt } of pictures) assert.ok(!live && wide >= 300 && shown > 100 && alt.length > 10, JSON.stringify(pictures));
      assert.equal(await page.$$eval('input[data-parameter]', (all) => all.every(({ disabled }) => disabled)), true);
    }));
}

// Every page with its first picture live. Whatever goes wrong in a viewer is an event, and on the page a message.
for (const name of names.filter((file) => file !== 'index.html')) {
  test(`${name} has a live picture`, () =>
    withPage(
      name,
      async (page) => {
        await until(page, () => document.querySelector('restir-viewer')?.viewer !== undefined);
        const failure = await page.evaluate(async () => {
          const viewers = [...document.querySelectorAll('restir-viewer')];
          const ends = viewers.map((viewer) => new Promise((resolve) => {
            viewer.addEventListener('sample', () => resolve(''));
            viewer.addEventListener('error', ({ detail }) => resolve(`${viewer.id}: ${detail.message}`));
          }));
          for (const [at, viewer] of viewers.entries()) {
            viewer.scrollIntoView();
            const said = await ends[at];
            if (said) return said;
          }
          return '';
        });
        assert.equal(failure, '');
      },
      { live: true },
    ));
}

test('a live picture replaces the still, and its slider changes it', () =>
  withPage(
    'ris.html',
    async (page) => {
      await until(page, () => document.querySelector('#resampled')?.viewer !== undefined);
      await page.evaluate(() => {
        window.samples = 0;
        const viewer = document.getElementById('resampled');
        viewer.addEventListener('sample', () => (window.samples += 1));
        viewer.scrollIntoView();
      });
      const brightness = async () => {
        await until(page, () => window.samples > 0);
        return page.evaluate(async () => {
          const { data } = await document.getElementById('resampled').viewer.capture({ type: 'rgba' });
          // Pixels that are black: one candidate leaves far more of them than many.
          let black = 0;
          for (let at = 0; at < data.length; at += 4) black += data[at] + data[at + 1] + data[at + 2] < 30 ? 1 : 0;
          return black / (data.length / 4);
        });
      };
      const many = await brightness();
      await page.evaluate(() => (window.samples = 0));
      await press(page, '#viewer-candidates', 'Home');
      assert.match(await page.$eval('#resampled', (viewer) => viewer.getAttribute('params')), /candidates=1$/);
      const one = await brightness();
      assert.ok(one > many + 0.05, `${one} of the pixels are black with one candidate, ${many} with 32`);
    },
    { live: true },
  ));

// The toys' logic, with fixed seeds

/** Runs `work` in a page with the toys' modules. */
const inPage = (work) => withPage('index.html', async (page) => work(page));

test('a reservoir keeps each in proportion to its weight, in any order', () =>
  inPage(async (page) => {
    const shares = await page.evaluate(async () => {
      const [{ keepOne, keptProbabilities }, { Random }] = await Promise.all([import('./reservoir.js'), import('./random.js')]);
      const runs = 40_000;
      return [[1, 4, 2, 0, 3, 10], [10, 3, 0, 2, 4, 1]].flatMap((weights) => {
        const random = new Random(7);
        const counts = weights.map(() => 0);
        for (let run = 0; run < runs; run++) counts[keepOne(weights, random)] += 1;
        return keptProbabilities(weights).map((exact, at) => ({ exact, share: counts[at] / runs, error: Math.sqrt((exact * (1 - exact)) / runs), weight: weights[at] }));
      });
    });
    for (const { exact, share, error, weight } of shares) {
      assert.equal(exact, weight / 20);
      within(share, exact, error, `weight ${weight}`);
    }
  }));

test('resampling has the mean and the variance of the closed form', () =>
  inPage(async (page) => {
    const rows = await page.evaluate(async () => {
      const [{ arriving, exampleLights, resample, resamplingVariance, total }, { Random }, { Estimate }] = await Promise.all([
        import('./resampling.js'), import('./random.js'), import('./estimate.js'),
      ]);
      const rows = [];
      for (const target of [(light) => light.unshadowed, arriving]) {
        for (const candidates of [1, 4, 32]) {
          const [random, estimate, squares] = [new Random(11), new Estimate(), new Estimate()];
          const [truth, variance] = [total(exampleLights), resamplingVariance(exampleLights, target, candidates)];
          for (let run = 0; run < 20_000; run++) {
            const value = resample(exampleLights, target, candidates, random);
            estimate.add(value);
            squares.add((value - truth) ** 2);
          }
          rows.push({ mean: estimate.mean, error: estimate.error, truth, squares: squares.mean, squaresError: squares.error, variance, name: `M=${candidates}` });
        }
      }
      return rows;
    });
    for (const { mean, error, truth, squares, squaresError, variance, name } of rows) {
      within(mean, truth, error, `mean, ${name}`);
      within(squares, variance, squaresError, `variance, ${name}`);
    }
    assert.ok(Math.abs(rows[0].truth - 22.9) < 1e-9);
  }));

test('a chain of frames has the noise of the closed form', () =>
  inPage(async (page) => {
    const { last, lastExact, mean, meanExact, value, valueError, truth } = await page.evaluate(async () => {
      const [{ chain, frameDeviations, meanDeviation }, { exampleLights, total }, { Random }, { Estimate }] = await Promise.all([
        import('./temporal.js'), import('./resampling.js'), import('./random.js'), import('./estimate.js'),
      ]);
      const [random, last, mean] = [new Random(5), new Estimate(), new Estimate()];
      for (let run = 0; run < 8000; run++) {
        const values = chain(exampleLights, 60, 20, random);
        last.add(values[59]);
        mean.add(values.reduce((sum, one) => sum + one, 0) / 60);
      }
      const [lastExact, meanExact] = [frameDeviations(exampleLights, 60, 20)[59], meanDeviation(exampleLights, 60, 20)];
      return { last: last.deviation, lastExact, mean: mean.deviation, meanExact, value: mean.mean, valueError: mean.error, truth: total(exampleLights) };
    });
    within(value, truth, valueError, 'the mean');
    // A deviation of 8000 nearly normal values is known to 1 / sqrt(2 × 8000), 0.8 %.
    assert.ok(Math.abs(last / lastExact - 1) < 0.035, `${last} of ${lastExact}`);
    assert.ok(Math.abs(mean / meanExact - 1) < 0.035, `${mean} of ${meanExact}`);
  }));

test('two pixels: 1/M is off by exactly what is shown, and no other weights are', () =>
  inPage(async (page) => {
    const rows = await page.evaluate(async () => {
      const [toy, { Random }, { Estimate }] = await Promise.all([import('./two-pixels.js'), import('./random.js'), import('./estimate.js')]);
      const weightings = ['constant', '1/z', 'balance', 'pairwise', 'defensive'];
      return [[1, 1], [1, 0.4], [1, -1.6], [5, 1]].flatMap(([neighbours, x]) => {
        const pixels = neighbours === 1 ? [toy.pixelA, toy.pixelB] : toy.rowOfPixels(neighbours);
        const targets = toy.targetsFor(pixels, toy.boardAt(x));
        const [random, estimates] = [new Random(3), weightings.map(() => new Estimate())];
        for (let run = 0; run < 20_000; run++) toy.runOnce(weightings, targets, 4, random).values.forEach((one, at) => estimates[at].add(one));
        const alone = targets[0].reduce((sum, one, y) => sum + (targets[1][y] > 0 ? 0 : one), 0);
        return weightings.map((weighting, at) => ({
          name: `${weighting}, ${neighbours} neighbours, board at ${x}`, weighting, neighbours, alone, truth: toy.trueValue(targets),
          expected: toy.expectedValue(weighting, targets), mean: estimates[at].mean, error: estimates[at].error,
        }));
      });
    });
    for (const { name, weighting, neighbours, alone, truth, expected, mean, error } of rows) {
      within(mean, expected, error, name);
      if (weighting !== 'constant') assert.ok(Math.abs(expected - truth) < 1e-12, `${name}: ${expected} of ${truth}`);
      // The bias is half of what A sees and B does not.
      else if (neighbours === 1) assert.ok(Math.abs(truth - expected - alone / 2) < 1e-12, name);
    }
    const [biased] = rows;
    assert.ok(biased.truth - biased.mean > 20 * biased.error, 'the bias is told from noise');
    assert.equal(rows.find(({ name }) => name === 'constant, 1 neighbours, board at -1.6').alone, 0);
  }));

// Clicks and keys

test('candidates are fed by clicks and by keys, once each', () =>
  withPage('reservoirs.html', async (page) => {
    assert.equal(await text(page, '#kept'), 'nothing');
    await page.click('#candidate-d');
    assert.equal(await text(page, '#kept'), 'nothing', 'a candidate of weight 0 is never kept');
    await page.click('#candidate-b');
    assert.equal(await value(page, '#weight-sum'), 4);
    assert.equal(await text(page, '#kept'), 'b', 'the first of a weight is');
    assert.match(await text(page, '#said'), /probability 1:/);
    await press(page, '#candidate-e', 'Enter');
    assert.equal(await value(page, '#weight-sum'), 7);
    assert.match(await text(page, '#said'), /probability 0\.429/);
    await page.click('#candidate-b');
    assert.equal(await value(page, '#count'), 3, 'no candidate comes twice');
    await page.click('#rest');
    assert.deepEqual([await value(page, '#count'), await value(page, '#weight-sum')], [6, 12]);
    assert.equal((await page.$$('#stream .kept')).length, 1);
    await page.click('#again');
    assert.deepEqual([await value(page, '#count'), await text(page, '#kept')], [0, 'nothing']);
  }));

test('the slider sets the weight of f, and the histogram follows', () =>
  withPage('reservoirs.html', async (page) => {
    await press(page, '#last-weight', 'Home', ...Array(10).fill('ArrowRight'));
    assert.equal(await text(page, '#last-weight-value'), '10');
    await page.click('#repeat');
    await page.click('#repeat');
    await untilRuns(page, 2000);
    const rows = await page.$$eval('#shares tr', (all) => all.map(({ dataset }) => ({ count: Number(dataset.count), exact: Number(dataset.probability) })));
    assert.equal(rows[5].exact, 0.5, 'half of all streams keep f');
    for (const { count, exact } of rows) within(count / 2000, exact, Math.sqrt((exact * (1 - exact)) / 2000), 'a share');
    await press(page, '#last-weight', 'ArrowRight');
    assert.equal(await value(page, '#runs'), 0, 'another stream begins anew');
  }));

test('M and the target set the deviation', () =>
  withPage('ris.html', async (page) => {
    const first = await value(page, '#exact-deviation');
    await page.click('#run');
    await untilRuns(page, 1000);
    await press(page, '#candidates', 'End');
    const floor = await value(page, '#exact-deviation');
    assert.ok(first > 30 && floor > 11.4 && floor < 13, `${first}, ${floor}`);
    assert.equal(await value(page, '#runs'), 0);
    await page.click('#run');
    await untilRuns(page, 1000);
    assert.ok(Math.abs((await value(page, '#deviation')) / floor - 1) < 0.1);
    await page.click('#with-visibility');
    assert.ok(Math.abs((await value(page, '#exact-deviation')) - first / 8) < 1e-9, '64 candidates, an eighth of the deviation');
  }));

test('the board sets the bias, and runs find it', () =>
  withPage('bias.html', async (page) => {
    const bias = (row) => value(page, `[id="row-${row}"] .bias`);
    assert.ok((await bias('constant')) < -0.2);
    await page.click('#one');
    await untilRuns(page, 1);
    assert.ok((await page.$$('#scene .chosen')).length > 0, 'what was kept is drawn');
    await page.click('#run');
    await untilRuns(page, 2001);
    for (const row of ['constant', '1/z', 'balance']) {
      const [mean, error, expected] = await page.$eval(`[id="row-${row}"]`, (element) => {
        const { dataset } = element.querySelector('.running');
        return [Number(dataset.value), Number(dataset.error), Number(element.querySelector('.expected').dataset.value)];
      });
      within(mean, expected, error, row);
      if (row !== 'constant') assert.ok(Math.abs(await bias(row)) < 1e-12);
    }
    // The board over A's side: different shadows, and yet no bias.
    await press(page, '#board', 'Home', ...Array(14).fill('ArrowRight'));
    assert.equal(await text(page, '#board-value'), '-1.6');
    assert.equal(await bias('constant'), 0);
    assert.equal((await page.$$('#scene .lamp.alone')).length, 0);
  }));

test('the history cap sets the noise of the last frame, and of the mean the other way round', () =>
  withPage('temporal.html', async (page) => {
    await press(page, '#cap', 'Home');
    const [last, mean] = [await value(page, '#exact-last'), await value(page, '#exact-mean')];
    await press(page, '#cap', 'End');
    assert.ok((await value(page, '#exact-last')) < last / 7 && (await value(page, '#exact-mean')) > mean * 1.3);
    await page.click('#run');
    await untilRuns(page, 1000);
    assert.ok(Math.abs((await value(page, '#last')) / (await value(page, '#exact-last')) - 1) < 0.1);
  }));

test('neighbours set bias, noise and cost', () =>
  withPage('weights.html', async (page) => {
    const read = (row, name) => value(page, `[id="row-${row}"] .${name}`);
    await press(page, '#neighbours', 'End');
    assert.deepEqual([await read('balance', 'cost'), await read('pairwise', 'cost')], [81, 25]);
    assert.ok((await read('constant', 'bias')) < -0.4);
    await page.click('#run');
    await untilRuns(page, 2000);
    for (const row of ['constant', '1/z', 'balance', 'pairwise', 'defensive']) {
      const error = await page.$eval(`[id="row-${row}"] .running`, ({ dataset }) => Number(dataset.error));
      within(await read(row, 'running'), await read(row, 'bias'), error, row);
    }
    assert.ok((await read('constant', 'deviation')) < (await read('balance', 'deviation')));
  }));

test('with less motion asked for, a press does all runs at once and moving scenes stay still', async (context) => {
  if ((process.env.BROWSER ?? 'chromium') !== 'chromium') return context.skip('Firefox cannot emulate it');
  const { page, problems } = await openPage(site, 'learn/');
  try {
    await page.emulateMediaFeatures([{ name: 'prefers-reduced-motion', value: 'reduce' }]);
    await page.goto(`${site.url}learn/temporal.html`);
    await until(page, () => !document.querySelector('.reduced-motion').hidden);
    assert.equal((await page.$$('restir-viewer')).length, 0);
    assert.equal((await page.$$('.pair img')).length, 2);
    const atOnce = await page.evaluate(() => {
      document.getElementById('run').click();
      return Number(document.getElementById('runs').dataset.value);
    });
    assert.equal(atOnce, 1000);
    assertNoProblems(problems);
  } finally {
    await page.close();
  }
});
