// Page 3: what a history does to one frame, and what it does to the mean of many.
import { Estimate } from './estimate.js';
import { Random } from './random.js';
import { exampleLights, total } from './resampling.js';
import { chain, frameDeviations, meanDeviation } from './temporal.js';
import { byId, follow, runner, shape, show } from './ui.js';
import { startViewers } from './viewers.js';

const slider = byId<HTMLInputElement>('cap');
const plot = byId<SVGElement>('plot');
const frames = 60;

let random = new Random(1);
let perFrame = Array.from({ length: frames }, () => new Estimate());
let mean = new Estimate();

const cap = () => Number(slider.value);

function draw(): void {
  const exact = frameDeviations(exampleLights, frames, cap());
  const most = exact[0] as number;
  const at = (frame: number, value: number) => [10 + frame * 4.8, 105 - (Math.min(value / most, 1.1) * 95)] as const;
  const points = exact.map((value, frame) => at(frame, value).join(',')).join(' ');
  const dots = perFrame.flatMap(({ deviation }, frame) => {
    const [cx, cy] = at(frame, deviation);
    return Number.isFinite(deviation) ? [shape('circle', { cx, cy, r: 2, class: 'dot' })] : [];
  });
  plot.replaceChildren(
    shape('line', { x1: 10, x2: 295, y1: 105, y2: 105, class: 'floor' }),
    shape('polyline', { points, class: 'truth', fill: 'none' }),
    ...dots,
    shape('text', { x: 10, y: 118 }, 'frame 1'),
    shape('text', { x: 294, y: 118, 'text-anchor': 'end' }, `frame ${frames}`),
  );
  show(byId('exact-last'), exact[frames - 1] as number);
  show(byId('exact-mean'), meanDeviation(exampleLights, frames, cap()));
  show(byId('last'), perFrame[frames - 1]?.deviation ?? NaN);
  show(byId('mean'), mean.deviation);
  show(byId('runs'), mean.count, String(mean.count));
  show(byId('value'), mean.mean);
  byId('value').dataset['error'] = String(mean.error);
}

function run(): void {
  const values = chain(exampleLights, frames, cap(), random);
  values.forEach((value, frame) => perFrame[frame]?.add(value));
  mean.add(values.reduce((sum, value) => sum + value, 0) / frames);
}

const { stop } = runner(byId('run'), 1000, run, draw);

follow([slider], () => {
  stop();
  [random, perFrame, mean] = [new Random(1), Array.from({ length: frames }, () => new Estimate()), new Estimate()];
  byId('cap-value').textContent = slider.value;
  draw();
});
show(byId('true-value'), total(exampleLights));
void startViewers();
