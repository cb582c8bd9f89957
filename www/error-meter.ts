// How far the picture is from a reference that the user kept: figures, curves against frames or time, and CSV.
import type { Errors, Failure } from './api.js';
import { save } from './files.js';
import { type Picture, errorsOf } from './measure.js';
import { byId } from './notices.js';
import { svgElement } from './elements.js';
import type { RestirViewer, Sample, Settings } from './viewer.js';

/** One measurement. */
interface Reading extends Errors {
  /** Frames in the picture. */
  frames: number;
  /** All that these took. */
  milliseconds: number;
  /** Whether that is the time of their passes on the GPU; else it goes until the page heard that the device was done, which may be milliseconds later. */
  onGpu: boolean;
}

/** How many frames took how long, by the page's clock. */
type Taken = Pick<Reading, 'frames' | 'milliseconds'>;

/** Measurements since a picture began. */
interface Curve {
  name: string;
  readings: Reading[];
}

/** So many curves are kept: the picture's own, and those before it. */
const mostCurves = 4;
/** Milliseconds between two measurements, which read the picture back. */
const interval = 300;
/** Milliseconds between two questions for the time of a frame, which is much the same for all of a picture. */
const timing = 3000;
const [width, height, margin] = [320, 180, 34];

const percent = (value: number | null, signed = false) =>
  value === null ? '–' : `${signed && value > 0 ? '+' : ''}${(100 * value).toPrecision(3)} %`;

/** Powers of ten that hold all `values`, which are above 0. */
function decades(values: number[]): [number, number] {
  const low = Math.floor(Math.log10(Math.min(...values)));
  return [low, Math.max(Math.ceil(Math.log10(Math.max(...values))), low + 1)];
}

/** What frames took on the GPU, each since the last reading as long as `lastFrame`; by the page's clock where the device does not tell. */
function onGpu({ frames, milliseconds }: Taken, lastFrame: number, before: Taken = { frames: 0, milliseconds: 0 }): Pick<Reading, 'milliseconds' | 'onGpu'> {
  if (lastFrame === 0) return { milliseconds, onGpu: false };
  return { milliseconds: before.milliseconds + (frames - before.frames) * lastFrame, onGpu: true };
}

/** The measurements of one picture. */
class Track {
  curves: Curve[] = [];
  private measuring = false;
  /** The last frame of a picture, which came while another one was measured. */
  private missed: Taken | undefined;
  private last = 0;
  /** Milliseconds of a frame on the GPU; 0 where the device does not tell. When it was asked. */
  private gpuFrame = 0;
  private timed = -Infinity;
  /** Of the picture that is being made. */
  private milliseconds = 0;
  private frames = 0;

  constructor(
    readonly view: RestirViewer,
    private readonly name: string,
    /** What it is compared with. */
    private readonly reference: () => Picture | undefined,
    /** Something was measured, or could not be. */
    private readonly measured: (problem?: string) => void,
  ) {
    view.addEventListener('sample', ({ detail }) => void this.observe(detail));
  }

  begin(): Curve {
    this.timed = -Infinity;
    const { technique, values } = this.view.settings;
    const own = [...values].filter(([key]) => !key.startsWith('film.')).map(([key, value]) => `${key}=${value}`);
    const curve: Curve = { name: [...(this.name ? [this.name] : []), technique, ...own].join(' '), readings: [] };
    // What was begun and not measured is nothing.
    this.curves = [...this.curves.filter(({ readings }) => readings.length > 0), curve].slice(-mostCurves);
    return curve;
  }

  /** Asks now and then what a frame takes on the GPU: each time frames wait. */
  private async time(): Promise<void> {
    if (performance.now() - this.timed < timing) return;
    const { passes } = await this.view.timings();
    this.gpuFrame = passes.reduce((sum, { ms }) => sum + ms, 0);
    this.timed = performance.now();
  }

  clear(): void {
    this.curves = [];
    this.frames = 0;
  }

  private async observe({ count, milliseconds, width, height, complete }: Sample): Promise<void> {
    const reference = this.reference();
    // A picture of another size is about to be resized.
    if (reference?.width !== width || reference.height !== height) return;
    if (reference.view !== this.view.settings.view) return;
    const begins = count <= this.frames || this.curves.length === 0;
    this.milliseconds = count <= this.frames ? milliseconds : this.milliseconds + milliseconds;
    this.frames = count;
    if (begins && this.view.accumulating) this.begin();
    if (begins) this.missed = undefined;
    const taken = { frames: count, milliseconds: this.milliseconds };
    if (this.measuring) {
      if (complete) this.missed = taken;
    } else if (begins || complete || performance.now() - this.last > interval) await this.measure(taken, reference);
  }

  private async measure(taken: Taken, reference: Picture): Promise<void> {
    this.measuring = true;
    const curve = this.curves.at(-1) ?? this.begin();
    try {
      // Between two frames: of the picture that this sample is of.
      const picture = await this.view.readPicture();
      if (picture.view !== reference.view) return;
      await this.time();
      const errors = await errorsOf(picture, reference);
      if (this.reference() !== reference) return;
      // Frames that are not averaged are each a picture of their own.
      const before = this.view.accumulating ? curve.readings : [];
      const time = onGpu(taken, this.gpuFrame, before.at(-1));
      curve.readings = [...before, { ...taken, ...time, ...errors }];
      this.measured();
    } catch (error) {
      // A lost device takes the picture, not the reference.
      const { code, message } = error as Failure;
      if (this.reference() === reference && code !== 'DEVICE') this.measured(message);
    } finally {
      this.measuring = false;
      // From the end: frames shall come between measurements that are slow.
      this.last = performance.now();
      const { missed } = this;
      this.missed = undefined;
      // The picture stands still, so it is still the one that was missed.
      if (missed && this.reference() === reference) void this.measure(missed, reference);
    }
  }
}

export class ErrorMeter {
  private tracks: Track[];

  constructor(private readonly view: RestirViewer) {
    this.tracks = [this.track(view, '')];
    byId('keep-reference', HTMLButtonElement).addEventListener('click', () => void this.keep());
    byId('errors-csv', HTMLButtonElement).addEventListener('click', () => this.save());
    byId('errors-axis', HTMLSelectElement).addEventListener('change', () => this.show());
    // From elsewhere, or of something else, the same light looks otherwise.
    for (const event of ['camera-change', 'load'] as const) view.addEventListener(event, () => this.forget());
    view.addEventListener('sample', ({ detail: { time } }) => {
      if (this.kept && view.moves && time !== this.kept.time) this.forget();
    });
    view.addEventListener('param-change', () => {
      const { size } = view.settings;
      if (this.kept && (size?.[0] !== this.kept.width || size[1] !== this.kept.height)) this.forget();
      else if (this.kept) this.show();
    });
    this.show();
  }

  /** Measures a second picture, too, or with undefined no longer. */
  compareWith(other: RestirViewer | undefined): void {
    const [first] = this.tracks;
    if (!first || this.tracks[1]?.view === other) return;
    this.tracks = other ? [first, this.track(other, 'B:')] : [first];
    this.show();
  }

  private track(view: RestirViewer, name: string): Track {
    const track: Track = new Track(view, name, () => (this.tracks.includes(track) ? this.kept : undefined), (problem) => {
      if (problem !== undefined) view.forgetReference();
      this.show(problem);
    });
    return track;
  }

  private async keep(): Promise<void> {
    await this.view.keepReference().catch(() => undefined);
    for (const track of this.tracks) track.clear();
    await Promise.all(this.tracks.map(({ view }) => view.reset().catch(() => undefined)));
    this.show();
  }

  private forget(): void {
    if (!this.kept) return;
    this.view.forgetReference();
    this.show('The camera, the moment, the size or the scene has changed: keep a new reference.');
  }

  private get kept(): Picture | undefined {
    return this.view.reference;
  }

  /** Says so where a picture shows something else than what was kept. */
  private get otherViews(): string {
    const others = this.tracks.flatMap(({ view: { settings } }, at) => (this.isComparable(settings) ? [] : [`picture ${'AB'[at]} ${settings.view}`]));
    return this.kept && others.length > 0 ? `The reference shows ${this.kept.view}, ${others.join(' and ')}: that is not measured.` : '';
  }

  private isComparable({ view }: Settings): boolean {
    return view === this.kept?.view;
  }

  private get curves(): Curve[] {
    return this.tracks.flatMap(({ curves }) => curves.slice(-Math.ceil(mostCurves / this.tracks.length)));
  }

  private show(words = 'Let the path tracer average many frames, keep the picture, then choose what to compare with it.'): void {
    const latest = this.tracks.map(({ curves, view: { settings } }) => (this.isComparable(settings) ? curves.at(-1)?.readings.at(-1) : undefined));
    const shown = this.kept && latest.some((reading) => reading);
    const figures: [string, (reading: Reading) => string][] = [
      ['MSE', ({ mse }) => mse.toExponential(2)],
      ['relative MSE', ({ relmse }) => relmse.toExponential(2)],
      ['MAPE', ({ mape }) => percent(mape)],
      ['FLIP', ({ flip }) => flip.toFixed(4)],
      ['bias', ({ bias }) => percent(bias, true)],
    ];
    const cell = (tag: 'th' | 'td', textContent: string, scope = '') => Object.assign(document.createElement(tag), { textContent, ...(scope && { scope }) });
    const line = (...cells: HTMLElement[]) => {
      const row = document.createElement('tr');
      row.append(...cells);
      return row;
    };
    const rows = figures.map(([name, value]) => line(cell('th', name, 'row'), ...latest.map((reading) => cell('td', reading ? value(reading) : '–'))));
    const heads = latest.length > 1 ? [line(cell('td', ''), cell('th', 'A', 'col'), cell('th', 'B', 'col'))] : [];
    byId('errors-table', HTMLTableElement).replaceChildren(...(shown ? [...heads, ...rows] : []));
    byId('errors-words', HTMLElement).textContent = this.kept ? this.otherViews : words;
    byId('errors-csv', HTMLButtonElement).disabled = this.curves.every((curve) => curve.readings.length === 0);
    this.plot();
  }

  /** MSE on two logarithmic axes. */
  private plot(): void {
    const byTime = byId('errors-axis', HTMLSelectElement).value === 'time';
    const points = ({ readings }: Curve) =>
      readings.map(({ frames, milliseconds, mse }): [number, number] => [byTime ? milliseconds : frames, mse]).filter(([x, y]) => x > 0 && y > 0);
    const all = this.curves.flatMap(points);
    const figure = byId('errors-plot', HTMLElement);
    const drawn = this.curves.filter((curve) => points(curve).length > 0);
    if (all.length === 0) return figure.replaceChildren();
    const [x0, x1] = decades(all.map(([x]) => x));
    const [y0, y1] = decades(all.map(([, y]) => y));
    const atX = (x: number) => margin + ((Math.log10(x) - x0) / (x1 - x0)) * (width - margin - 8);
    const atY = (y: number) => 6 + ((y1 - Math.log10(y)) / (y1 - y0)) * (height - margin);
    const isOnGpu = drawn.every(({ readings }) => readings.every((reading) => reading.onGpu));
    const picture = svgElement('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': `MSE against ${byTime ? 'time' : 'frames'}` });
    for (let power = x0; power <= x1; power++) {
      const x = atX(10 ** power);
      picture.append(svgElement('line', { x1: x, x2: x, y1: atY(10 ** y1), y2: atY(10 ** y0), class: 'grid' }), svgElement('text', { x, y: height - 14, 'text-anchor': 'middle' }, `1e${power}`));
    }
    for (let power = y0; power <= y1; power++) {
      const y = atY(10 ** power);
      picture.append(svgElement('line', { x1: margin, x2: width - 8, y1: y, y2: y, class: 'grid' }), svgElement('text', { x: margin - 4, y: y + 3, 'text-anchor': 'end' }, `1e${power}`));
    }
    picture.append(svgElement('text', { x: width / 2, y: height - 2, 'text-anchor': 'middle' }, byTime ? (isOnGpu ? 'milliseconds on the GPU' : 'milliseconds') : 'frames'));
    for (const [index, curve] of drawn.entries()) {
      const line = points(curve).map(([x, y]) => `${atX(x).toFixed(1)},${atY(y).toFixed(1)}`).join(' ');
      picture.append(svgElement('polyline', { points: line, class: `curve curve-${index}` }));
      const [x, y] = points(curve).at(-1) ?? [1, 1];
      picture.append(svgElement('circle', { cx: atX(x), cy: atY(y), r: 2.5, class: `curve-${index}` }));
    }
    const legend = document.createElement('ul');
    for (const [index, { name }] of drawn.entries()) {
      const item = document.createElement('li');
      item.append(Object.assign(document.createElement('i'), { className: `curve-${index}` }), name);
      legend.append(item);
    }
    figure.replaceChildren(picture, legend);
  }

  private save(): void {
    const quoted = (text: string) => `"${text.replaceAll('"', '""')}"`;
    const lines = this.curves.flatMap(({ name, readings }) =>
      readings.map(({ frames, milliseconds, mse, relmse, mape, bias, flip, onGpu: isGpu }) =>
        [quoted(name), frames, milliseconds.toFixed(3), mse, relmse, mape ?? '', bias ?? '', flip, isGpu ? 'GPU' : 'page'].join(','),
      ),
    );
    const csv = ['series,frames,milliseconds,mse,relmse,mape,bias,flip,clock', ...lines, ''].join('\n');
    save(new Blob([csv], { type: 'text/csv' }), 'errors.csv');
  }
}
