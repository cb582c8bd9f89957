// Page 4: pixel A reuses the sample of pixel B. What the joined estimate is expected to be, and what it turns out to be.
import { Estimate } from './estimate.js';
import { Random } from './random.js';
import { type Kept, type Point, type Weighting, boardAt, expectedValue, lamps, pixelA, pixelB, runOnce, sees, targetsFor, trueValue } from './two-pixels.js';
import { byId, follow, runner, shape, short, show, withError } from './ui.js';
import { startViewers } from './viewers.js';

const slider = byId<HTMLInputElement>('board');
const scene = byId<SVGElement>('scene');
const weightings: readonly Weighting[] = ['constant', '1/z', 'balance'];
const candidates = 4;

let random = new Random(1);
let estimates = weightings.map(() => new Estimate());
let samples: readonly (Kept | undefined)[] = [];

const board = () => boardAt(Number(slider.value));
const targets = () => targetsFor([pixelA, pixelB], board());

/** To the picture's units: 40 for one of the scene's, y down. */
const place = ({ x, y }: Point): [number, number] => [160 + 40 * x, 140 - 40 * y];

function line(from: Point, to: Point, name: string): SVGElement {
  const [[x1, y1], [x2, y2]] = [place(from), place(to)];
  return shape('line', { x1, y1, x2, y2, class: name });
}

function drawScene(): void {
  const pixels: [string, Point][] = [['A', pixelA], ['B', pixelB]];
  const { left, right, y } = board();
  const rays = pixels.flatMap(([name, pixel]) => lamps.filter((lamp) => sees(pixel, lamp, board())).map((lamp) => line(pixel, lamp, `ray ${name}`)));
  const chosen = pixels.flatMap(([name, pixel], i) => {
    const lamp = lamps[samples[i]?.lamp ?? -1];
    return lamp ? [line(pixel, lamp, `chosen ${name}`)] : [];
  });
  const labels = lamps.flatMap((lamp) => {
    const who = pixels.filter(([, pixel]) => sees(pixel, lamp, board())).map(([name]) => name).join('');
    const [x, top] = place(lamp);
    return [
      shape('circle', { cx: x, cy: top, r: 3 + Math.sqrt(lamp.power), class: who === 'A' ? 'lamp alone' : 'lamp' }),
      shape('text', { x, y: top - 9, 'text-anchor': 'middle' }, who || '–'),
    ];
  });
  const feet = pixels.flatMap(([name, pixel]) => {
    const [x, top] = place(pixel);
    return [shape('circle', { cx: x, cy: top, r: 5, class: `pixel ${name}` }), shape('text', { x, y: top + 17, 'text-anchor': 'middle' }, name)];
  });
  scene.replaceChildren(...rays, ...chosen, line({ x: -4, y: 0 }, { x: 4, y: 0 }, 'floor'), line({ x: left, y }, { x: right, y }, 'board'), ...labels, ...feet);
}

function draw(): void {
  drawScene();
  const truth = trueValue(targets());
  show(byId('runs'), estimates[0]?.count ?? 0, String(estimates[0]?.count ?? 0));
  show(byId('true-value'), truth);
  weightings.forEach((weighting, at) => {
    const { mean, error, count } = estimates[at] as Estimate;
    const expected = expectedValue(weighting, targets());
    const row = byId(`row-${weighting}`);
    const cell = (name: string) => row.querySelector(`.${name}`) as HTMLElement;
    show(cell('expected'), expected);
    show(cell('bias'), expected / truth - 1, `${short(Math.round((expected / truth - 1) * 1000) / 10)} %`);
    show(cell('running'), mean, count ? withError(mean, error) : '–');
    cell('running').dataset['error'] = String(error);
  });
}

function run(): void {
  const { samples: kept, values } = runOnce(weightings, targets(), candidates, random);
  samples = kept;
  values.forEach((value, at) => estimates[at]?.add(value));
}

runner(byId('one'), 1, run, draw);
const { stop } = runner(byId('run'), 2000, run, draw);

follow([slider], () => {
  stop();
  [random, estimates, samples] = [new Random(1), weightings.map(() => new Estimate()), []];
  byId('board-value').textContent = Number(slider.value).toFixed(1);
  draw();
});
void startViewers();
