// Page 1: how the error of resampled importance sampling falls with M, against its closed form.
import { Estimate } from './estimate.js';
import { Random } from './random.js';
import { type Target, arriving, exampleLights, resample, resamplingVariance, total } from './resampling.js';
import { byId, follow, runner, shape, show, withError } from './ui.js';
import { startViewers } from './viewers.js';

const candidates = byId<HTMLInputElement>('candidates');
const chart = byId<SVGElement>('lights');
const strip = byId<SVGElement>('strip');
const unshadowed: Target = (light) => light.unshadowed;
const [remembered, widest] = [150, 90];

let random = new Random(1);
let estimate = new Estimate();
let recent: number[] = [];

const withVisibility = () => byId<HTMLInputElement>('with-visibility').checked;
const target = () => (withVisibility() ? arriving : unshadowed);

function drawLights(): void {
  const most = Math.max(...exampleLights.map(unshadowed));
  const bars = exampleLights.flatMap((light, at) => {
    const bar = (value: number, name: string) => {
      const height = (value / most) * 90;
      return shape('rect', { x: at * 25 + 3, y: 95 - height, width: 19, height, class: name });
    };
    return [bar(target()(light), 'target'), bar(arriving(light), 'seen')];
  });
  chart.replaceChildren(...bars);
}

function draw(): void {
  show(byId('mean'), estimate.mean, estimate.count ? withError(estimate.mean, estimate.error) : '–');
  show(byId('deviation'), estimate.deviation);
  show(byId('runs'), estimate.count, String(estimate.count));
  const across = (value: number) => (Math.min(value, widest) / widest) * 290 + 5;
  const dots = recent.map((value, at) => shape('circle', { cx: across(value), cy: 8 + ((at * 37) % 44), r: 2.5, class: 'dot' }));
  const truth = across(total(exampleLights));
  strip.replaceChildren(...dots, shape('line', { x1: truth, x2: truth, y1: 0, y2: 60, class: 'truth' }));
}

function run(): void {
  const value = resample(exampleLights, target(), Number(candidates.value), random);
  estimate.add(value);
  recent = [...recent.slice(1 - remembered), value];
}

const { stop } = runner(byId('run'), 1000, run, draw);

follow([candidates, byId('with-visibility'), byId('without-visibility')], () => {
  stop();
  [random, estimate, recent] = [new Random(1), new Estimate(), []];
  byId('candidates-value').textContent = candidates.value;
  show(byId('exact-deviation'), Math.sqrt(resamplingVariance(exampleLights, target(), Number(candidates.value))));
  drawLights();
  draw();
});
show(byId('true-value'), total(exampleLights));
void startViewers();
