// The last minute of frames: the time of each pass as stacked areas, and the figures of one reading at a time.
import { byId, withUnit } from './notices.js';
import { svgElement } from './elements.js';
import { type Reading, layersOf } from './readings.js';

/** So many readings are kept. */
const most = 120;
const [width, height] = [320, 90];

export class TimingHistory {
  private readings: Reading[] = [];
  /** The reading that is looked at; undefined for the last one. */
  private chosen: number | undefined;
  private readonly areas = svgElement('g', {});
  private readonly cursor = svgElement('line', { y1: 0, y2: height, class: 'cursor', visibility: 'hidden' });
  private readonly chart = svgElement('svg', {
    viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: 'none', tabindex: 0, role: 'slider',
    'aria-label': 'Readings of the last minute', 'aria-valuemin': 1, 'aria-valuenow': 1,
  });
  private readonly words = document.createElement('figcaption');

  constructor() {
    const { chart } = this;
    chart.append(this.areas, this.cursor);
    byId('pass-history', HTMLElement).append(chart, this.words);
    chart.addEventListener('pointermove', (event) => {
      const { left, width: shown } = chart.getBoundingClientRect();
      this.choose(Math.round(((event.clientX - left) / shown) * (most - 1)) - (most - this.readings.length));
    });
    for (const event of ['pointerleave', 'blur'] as const) chart.addEventListener(event, () => this.choose(undefined));
    chart.addEventListener('keydown', (event) => {
      const last = this.readings.length - 1;
      const now = this.chosen ?? last;
      const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: last }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.choose(to);
    });
  }

  /** Takes note of a frame. */
  add(reading: Reading): void {
    this.readings = [...this.readings, reading].slice(-most);
    // What is looked at moves along.
    if (this.chosen !== undefined && this.readings.length === most) this.chosen = Math.max(this.chosen - 1, 0);
    this.show();
  }

  private choose(at: number | undefined): void {
    this.chosen = at === undefined ? undefined : Math.min(Math.max(at, 0), this.readings.length - 1);
    this.show();
  }

  private show(): void {
    const { readings } = this;
    if (!byId('timing', HTMLDetailsElement).open || readings.length === 0) return;
    const layers = layersOf(readings);
    const sums = readings.map((_, at) => layers.reduce((sum, { values }) => sum + (values[at] ?? 0), 0));
    const top = Math.max(...sums) || 1;
    // The newest is at the right.
    const x = (at: number) => (((at + most - readings.length) / (most - 1)) * width).toFixed(1);
    const y = (ms: number) => (height * (1 - ms / top)).toFixed(1);
    const floor = readings.map(() => 0);
    const polygons = layers.map(({ values }, index) => {
      const below = floor.map((ms, at) => `${x(at)},${y(ms)}`).reverse();
      for (const [at, ms] of values.entries()) floor[at] = (floor[at] ?? 0) + ms;
      const above = floor.map((ms, at) => `${x(at)},${y(ms)}`);
      return svgElement('polygon', { points: [...above, ...below].join(' '), class: `area pass-${Math.min(index, 7)}` });
    });
    this.areas.replaceChildren(...polygons);
    this.showReading(this.chosen ?? readings.length - 1, x, top);
  }

  private showReading(at: number, x: (at: number) => string, top: number): void {
    const { chart, cursor, chosen, readings } = this;
    const reading = readings[at];
    if (!reading) return;
    const { milliseconds, rays } = reading;
    const place = readings.length - 1 - at;
    const when = place === 0 ? 'Last reading' : `${place} ${place === 1 ? 'reading' : 'readings'} before`;
    const text = `${milliseconds.toFixed(milliseconds < 10 ? 2 : 0)} ms a frame, ${withUnit((1000 * rays) / milliseconds)}rays/s`;
    this.words.textContent = `${when}: ${text}. Top: ${top.toFixed(top < 10 ? 2 : 0)} ms.`;
    for (const [name, value] of Object.entries({ 'aria-valuenow': at + 1, 'aria-valuemax': readings.length, 'aria-valuetext': `${when}: ${text}` })) {
      chart.setAttribute(name, String(value));
    }
    cursor.setAttribute('visibility', chosen === undefined ? 'hidden' : 'visible');
    for (const end of ['x1', 'x2']) cursor.setAttribute(end, x(at));
  }
}
