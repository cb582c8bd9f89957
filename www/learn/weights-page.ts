// Page 5: five ways of weighting a pixel's neighbours: bias with error bars, noise and cost.
import { Estimate } from './estimate.js';
import { Random } from './random.js';
import { type Weighting, boardAt, evaluations, expectedValue, rowOfPixels, runOnce, targetsFor, trueValue } from './two-pixels.js';
import { byId, follow, runner, shape, show } from './ui.js';
import { startViewers } from './viewers.js';

const slider = byId<HTMLInputElement>('neighbours');
const weightings: readonly Weighting[] = ['constant', '1/z', 'balance', 'pairwise', 'defensive'];
/** The meter shows biases from the first to the second. */
const [lowest, highest] = [-0.6, 0.2];
const candidates = 4;

let random = new Random(1);
let estimates = weightings.map(() => new Estimate());

const targets = () => targetsFor(rowOfPixels(Number(slider.value)), boardAt(1));
const across = (bias: number) => ((Math.min(Math.max(bias, lowest), highest) - lowest) / (highest - lowest)) * 110 + 5;

function draw(): void {
  const all = targets();
  const truth = trueValue(all);
  show(byId('runs'), estimates[0]?.count ?? 0, String(estimates[0]?.count ?? 0));
  weightings.forEach((weighting, at) => {
    const { mean, error, deviation, count } = estimates[at] as Estimate;
    const row = byId(`row-${weighting}`);
    const cell = <Type extends Element = HTMLElement>(name: string) => row.querySelector(`.${name}`) as Element as Type;
    const bias = expectedValue(weighting, all) / truth - 1;
    const percent = (part: number) => `${(100 * part).toFixed(1).replace('-0.0', '0.0').replace('-', '−')} %`;
    show(cell('bias'), bias, percent(bias));
    const known = count > 1;
    show(cell('running'), mean / truth - 1, known ? `${percent(mean / truth - 1)} ± ${((100 * error) / truth).toFixed(1)}` : '–');
    cell('running').dataset['error'] = String(error / truth);
    show(cell('deviation'), deviation / truth, known ? percent(deviation / truth) : '–');
    show(cell('cost'), evaluations(weighting, all.length));
    const [x1, x2, tick, zero] = [mean / truth - 1 - (2 * error) / truth, mean / truth - 1 + (2 * error) / truth, bias, 0].map(across) as [number, number, number, number];
    cell<SVGElement>('meter').replaceChildren(
      shape('line', { x1: zero, x2: zero, y1: 0, y2: 14, stroke: 'currentColor', 'stroke-opacity': 0.4 }),
      ...(known ? [shape('line', { x1, x2, y1: 7, y2: 7, class: 'bar' })] : []),
      shape('line', { x1: tick, x2: tick, y1: 2, y2: 12, class: 'truth' }),
    );
  });
}

function run(): void {
  runOnce(weightings, targets(), candidates, random).values.forEach((value, at) => estimates[at]?.add(value));
}

const { stop } = runner(byId('run'), 2000, run, draw);

follow([slider], () => {
  stop();
  [random, estimates] = [new Random(1), weightings.map(() => new Estimate())];
  byId('neighbours-value').textContent = slider.value;
  draw();
});
void startViewers();
