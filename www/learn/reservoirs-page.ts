// Page 2: a stream of candidates to click, a reservoir, and a histogram of what is kept over many streams.
import { Random } from './random.js';
import { Reservoir, keepOne, keptProbabilities } from './reservoir.js';
import { byId, follow, runner, shape, short, show } from './ui.js';
import { startViewers } from './viewers.js';

const slider = byId<HTMLInputElement>('last-weight');
const stream = byId('stream');
const histogram = byId<SVGElement>('histogram');
const names = ['a', 'b', 'c', 'd', 'e', 'f'];
/** Of all but the last, whose weight the slider sets. */
const firstWeights = [1, 4, 2, 0, 3];
/** Where candidates lie in their field, in hundredths of its sides. */
const places = [[12, 62], [30, 32], [47, 70], [58, 24], [68, 66], [88, 40]] as const;

const weights = () => [...firstWeights, Number(slider.value)];

let random = new Random(1);
let reservoir = new Reservoir<number>();
let counts = names.map(() => 0);
let said = '';

const buttons = names.map((name, at) => {
  const button = document.createElement('button');
  const [left, top] = places[at] as readonly [number, number];
  button.type = 'button';
  button.id = `candidate-${name}`;
  button.style.left = `${left}%`;
  button.style.top = `${top}%`;
  button.addEventListener('click', () => feed(at));
  return button;
});
stream.replaceChildren(...buttons);

function feed(at: number): void {
  const button = buttons[at];
  if (!button || button.getAttribute('aria-disabled') === 'true') return;
  const weight = weights()[at] as number;
  const replaced = reservoir.update(at, weight, random);
  const chance = reservoir.weightSum > 0 ? weight / reservoir.weightSum : 0;
  said = `${names[at]} was taken with probability ${short(chance)}: ${replaced ? 'it is kept now' : 'it was passed over'}.`;
  button.setAttribute('aria-disabled', 'true');
  draw();
}

function drawReservoir(): void {
  show(byId('weight-sum'), reservoir.weightSum);
  show(byId('count'), reservoir.count);
  byId('kept').textContent = reservoir.sample === undefined ? 'nothing' : (names[reservoir.sample] as string);
  byId('said').textContent = said;
  buttons.forEach((button, at) => {
    const weight = weights()[at] as number;
    const size = 22 + 11 * Math.sqrt(weight);
    button.style.width = button.style.height = `${size}px`;
    button.textContent = names[at] as string;
    button.setAttribute('aria-label', `Feed ${names[at]}, of weight ${weight}`);
    button.classList.toggle('kept', reservoir.sample === at);
  });
}

function drawHistogram(): void {
  const runs = counts.reduce((sum, count) => sum + count, 0);
  show(byId('runs'), runs, String(runs));
  const exact = keptProbabilities(weights());
  const parts = names.flatMap((name, at) => {
    const share = runs > 0 ? (counts[at] as number) / runs : 0;
    const probability = exact[at] as number;
    const [x, base] = [at * 48 + 8, 112];
    return [
      shape('rect', { x, y: base - share * 100, width: 32, height: share * 100, class: 'seen' }),
      shape('line', { x1: x - 4, x2: x + 36, y1: base - probability * 100, y2: base - probability * 100, class: 'truth' }),
      shape('text', { x: x + 16, y: 124, 'text-anchor': 'middle' }, name),
    ];
  });
  histogram.replaceChildren(...parts);
  const rows = names.map((name, at) => {
    const row = document.createElement('tr');
    const cells = [name, String(weights()[at]), short(exact[at] as number), runs > 0 ? ((counts[at] as number) / runs).toFixed(3) : '–'];
    row.append(...cells.map((text, column) => Object.assign(document.createElement(column === 0 ? 'th' : 'td'), { textContent: text })));
    row.dataset['count'] = String(counts[at]);
    row.dataset['probability'] = String(exact[at]);
    return row;
  });
  byId('shares').replaceChildren(...rows);
}

function draw(): void {
  drawReservoir();
  drawHistogram();
}

function empty(): void {
  reservoir = new Reservoir();
  said = 'Click a circle.';
  for (const button of buttons) button.removeAttribute('aria-disabled');
}

const repeat = () => {
  const kept = keepOne(weights(), random);
  if (kept !== undefined) counts[kept] = (counts[kept] as number) + 1;
};
const { stop } = runner(byId('repeat'), 1000, repeat, drawHistogram);

byId('again').addEventListener('click', () => {
  empty();
  draw();
});
byId('rest').addEventListener('click', () => names.forEach((_, at) => feed(at)));
follow([slider], () => {
  stop();
  [random, counts] = [new Random(1), names.map(() => 0)];
  byId('last-weight-value').textContent = slider.value;
  empty();
  draw();
});
void startViewers();
