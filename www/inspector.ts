// The pixel inspector: what the passes saw at a pixel, in words, in the papers' symbols, and as lines in the picture.
import type { Inspection, Note, Vector } from './api.js';
import { make, svgElement } from './elements.js';
import { explainPixel, lastResult, short, stagesOf } from './explain-pixel.js';
import { byId } from './notices.js';
import { pixelAt, projectLine } from './overlay.js';
import { luminance } from './vectors.js';
import type { RestirViewer } from './viewer.js';

/** Milliseconds between two readings. */
const interval = 200;
/** Frames that are remembered of a pixel. */
const mostFrames = 12;
/** Candidates that are listed and drawn: the heaviest. */
const mostCandidates = 8;
/** A press that moves further, in CSS pixels, is a drag. */
const stillness = 4;

interface Frame {
  /** Frames in the picture. */
  count: number;
  seen: Inspection;
}

function table(head: string[], rows: string[][], caption: string): HTMLElement {
  const body = rows.map((row) => make('tr', {}, ...row.map((cell, at) => make(at === 0 ? 'th' : 'td', cell))));
  const headings = head.map((cell) => make('th', { scope: 'col' }, cell));
  const whole = make('table', {}, make('caption', caption), make('thead', {}, make('tr', {}, ...headings)), make('tbody', {}, ...body));
  for (const cell of whole.querySelectorAll<HTMLTableCellElement>('tbody th')) cell.scope = 'row';
  return make('div', { className: 'wide' }, whole);
}

const lightName = ({ sample }: Note) => (sample ? `${sample.light_kind} ${sample.light}` : '–');

export class Inspector {
  private pixel: [number, number] | undefined;
  private size: [number, number] = [1, 1];
  private frames: Frame[] = [];
  /** Ids of the sections that are open. */
  private open = new Set(['inspector-reservoirs']);
  private readingSince = 0;
  private pressed: [number, number] | undefined;
  private readonly panel = byId('inspector', HTMLElement);
  private readonly button = byId('inspect', HTMLButtonElement);
  private readonly marks = document.getElementById('marks') as unknown as SVGSVGElement;

  constructor(
    private readonly view: RestirViewer,
    canvas: HTMLCanvasElement,
    /** Told when it opens: there is room for one panel. */
    private readonly opening: () => void,
  ) {
    this.button.addEventListener('click', () => void (this.active ? this.end() : this.begin()));
    byId('inspector-close', HTMLButtonElement).addEventListener('click', () => void this.end());
    canvas.addEventListener('pointerdown', ({ clientX, clientY }) => (this.pressed = [clientX, clientY]));
    canvas.addEventListener('pointerup', ({ clientX, clientY, button }) => {
      const [x = 0, y = 0] = this.pressed ?? [];
      if (!this.active || button !== 0 || Math.hypot(clientX - x, clientY - y) > stillness) return;
      const pixel = pixelAt(canvas, this.size, clientX, clientY);
      if (pixel) void this.choose(pixel);
    });
    // Shift and an arrow go to the next pixel, before the camera takes the key.
    canvas.addEventListener('keydown', (event) => this.step(event), { capture: true });
    view.addEventListener('sample', ({ detail: { count, width, height } }) => {
      const [before, across] = this.size;
      this.size = [width, height];
      // The same place in a picture of another size.
      if (this.pixel && (before !== width || across !== height)) {
        void this.choose([Math.floor((this.pixel[0] * width) / before), Math.floor((this.pixel[1] * height) / across)]);
      } else void this.read(count);
    });
    view.addEventListener('load', () => this.pixel && void this.choose(this.pixel));
    view.addEventListener('restored', () => this.pixel && void this.choose(this.pixel));
    addEventListener('resize', () => this.draw());
  }

  private get active(): boolean {
    return !this.panel.hidden;
  }

  /** Opens the panel, at the middle of the picture until a pixel is clicked. */
  private async begin(): Promise<void> {
    this.opening();
    this.panel.hidden = false;
    this.button.setAttribute('aria-pressed', 'true');
    document.body.classList.add('inspecting');
    await this.choose(this.pixel ?? [this.size[0] >> 1, this.size[1] >> 1]);
  }

  /** Closes the panel, if it is open. */
  async end(): Promise<void> {
    if (!this.active) return;
    this.panel.hidden = true;
    this.button.setAttribute('aria-pressed', 'false');
    document.body.classList.remove('inspecting');
    this.pixel = undefined;
    this.frames = [];
    this.draw();
    await this.view.inspect(undefined).catch(() => undefined);
  }

  private step(event: KeyboardEvent): void {
    const [dx, dy] = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] } as Record<string, [number, number]>)[event.key] ?? [];
    if (!this.active || !event.shiftKey || !this.pixel || dx === undefined || dy === undefined) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const inside = (value: number, length: number) => Math.min(Math.max(value, 0), length - 1);
    void this.choose([inside(this.pixel[0] + dx, this.size[0]), inside(this.pixel[1] + dy, this.size[1])]);
  }

  private async choose(pixel: [number, number]): Promise<void> {
    // A picture that has become smaller may have lost it.
    this.pixel = [Math.min(pixel[0], this.size[0] - 1), Math.min(pixel[1], this.size[1] - 1)];
    this.frames = [];
    byId('inspector-where', HTMLElement).textContent = `Pixel ${this.pixel.join(', ')}`;
    this.remember();
    byId('inspector-words', HTMLElement).textContent = 'The next frame will tell.';
    this.draw();
    try {
      await this.view.inspect(this.pixel);
    } catch {
      return;
    }
    this.readingSince = -Infinity;
    // A picture that stands still needs another frame for it.
    this.view.renderFrame();
  }

  private async read(count: number): Promise<void> {
    const { pixel } = this;
    const now = performance.now();
    if (!pixel || now - this.readingSince < interval) return;
    this.readingSince = now;
    const seen = await this.view.inspection().catch(() => undefined);
    if (!seen || !this.pixel || seen.pixel[0] !== this.pixel[0] || seen.pixel[1] !== this.pixel[1]) return;
    this.frames = [...this.frames, { count, seen }].slice(-mostFrames);
    this.show();
    this.draw();
  }

  // Words

  private show(): void {
    const seen = this.frames.at(-1)?.seen;
    if (!seen) return;
    this.remember();
    const why = make('ul', {}, ...explainPixel(seen).map((text) => make('li', text)));
    const parts: HTMLElement[] = [why, this.reservoirs(seen), ...this.domains(seen), this.candidates(seen), this.surface(seen), this.history()].filter((part) => part !== undefined);
    for (const part of parts) if (part instanceof HTMLDetailsElement) part.open = this.open.has(part.id);
    byId('inspector-words', HTMLElement).replaceChildren(...parts);
  }

  /** Notes which sections are open, for they are made anew. */
  private remember(): void {
    const sections = [...this.panel.querySelectorAll('details')];
    if (sections.length > 0) this.open = new Set(sections.filter(({ open }) => open).map(({ id }) => id));
  }

  private section(id: string, title: string, ...parts: HTMLElement[]): HTMLDetailsElement {
    return make('details', { id: `inspector-${id}` }, make('summary', title), ...parts);
  }

  private reservoirs(seen: Inspection): HTMLElement | undefined {
    const results = seen.notes.filter(({ kind }) => kind === 'result');
    if (results.length === 0) return undefined;
    const rows = results.map((note) => {
      const { stage, slot, sample, unbiased_contribution_weight: w, confidence_weight: c } = note;
      const name = results.some((other) => other.slot > 0) ? `${stage}, ${slot + 1}` : stage;
      return [name, lightName(note), short(w), short(c), short(sample?.target_value ?? 0), short(w * (sample?.target_value ?? 0)), note.is_visible ? 'yes' : 'no'];
    });
    const words = make('p', 'A reservoir holds one sample, the chosen light point y. W stands for 1 / p(y): how much the sample counts. c says for how much it speaks: for so many frames of candidates, in restir-report for so many samples. p̂ is what the sample would give if it is lit; p̂ W is the pixel\'s estimate.');
    return this.section('reservoirs', 'Reservoir after each pass', table(['after', 'y', 'W', 'c', 'p̂(y)', 'p̂ W', 'lit'], rows, 'Reservoir after each pass'), words);
  }

  private domains(seen: Inspection): HTMLElement[] {
    return stagesOf(seen).filter((stage) => stage !== 'initial').flatMap((stage) => {
      const domains = seen.notes.filter((note) => note.kind === 'domain' && note.stage === stage && note.slot === 0);
      if (domains.length === 0) return [];
      const rows = domains.map((note, at) => {
        const from = at === 0 ? 'this pixel' : `${note.pixel?.join(', ')}${stage === 'temporal' ? ', a frame ago' : ''}`;
        const { sample, unbiased_contribution_weight: w, confidence_weight: c, mis_weight: m, resampling_weight: weight } = note;
        return [from, lightName(note), short(c), short(w), short(sample?.target_value ?? 0), short(m), short(weight)];
      });
      const title = stage === 'temporal' ? 'History that joined' : `Neighbours that joined, ${stage}`;
      const words = make('p', 'Each sample is offered with the resampling weight w = m p̂ W; one is chosen with a chance in proportion to it, and gets W = Σ w / p̂(y).');
      return [this.section(stage.replace(' ', '-'), title, table(['from', 'y', 'c', 'W', 'p̂(y)', 'm', 'w'], rows, title), words)];
    });
  }

  private heaviest({ notes }: Inspection): Note[] {
    const candidates = notes.filter(({ kind }) => kind === 'candidate');
    return candidates.sort((a, b) => b.resampling_weight - a.resampling_weight).slice(0, mostCandidates);
  }

  private candidates(seen: Inspection): HTMLElement | undefined {
    const all = seen.notes.filter(({ kind }) => kind === 'candidate');
    if (all.length === 0) return undefined;
    const sum = all.reduce((total, { resampling_weight: weight }) => total + weight, 0);
    const rows = this.heaviest(seen).map((note) => [lightName(note), short(note.sample?.target_value ?? 0), short(note.resampling_weight), sum > 0 ? `${Math.round((100 * note.resampling_weight) / sum)} %` : '–']);
    const title = `Candidates, ${all.length}`;
    const words = make('p', `The ${rows.length} heaviest. w = m p̂ / p is the resampling weight, p the density with which the candidate was drawn.${seen.dropped > 0 ? ` ${seen.dropped} notes found no room.` : ''}`);
    return this.section('candidates', title, table(['light', 'p̂', 'w', 'chance'], rows, title), words);
  }

  private surface({ surface, radiance, mean, samples }: Inspection): HTMLElement {
    const vector = (value: Vector) => value.map(short).join(', ');
    const rows = [['radiance of this frame', vector(radiance)], [`mean of ${samples}`, vector(mean)]];
    if (surface) {
      rows.push(['position', vector(surface.position)], ['normal', vector(surface.normal)], ['depth', `${short(surface.depth)} m`]);
      rows.push(['base colour', vector(surface.base_color)], ['metallic, roughness', `${short(surface.metallic)}, ${short(surface.roughness)}`]);
      rows.push(['emission', vector(surface.emission)], ['instance, triangle', `${surface.instance}, ${surface.triangle}`]);
    }
    return this.section('surface', 'Surface and light', table(['what', 'value'], rows, 'Surface and light'));
  }

  private history(): HTMLElement {
    const rows = this.frames.map(({ count, seen }) => {
      const last = lastResult(seen);
      return [String(count), last ? lightName(last) : '–', short(last?.unbiased_contribution_weight ?? 0), short(last?.confidence_weight ?? 0), short(luminance(seen.radiance))];
    });
    return this.section('history', 'Last frames', table(['frame', 'y', 'W', 'c', 'luminance'], rows, 'Last frames'));
  }

  // Lines

  private draw(): void {
    const { marks, size, pixel } = this;
    const seen = this.frames.at(-1)?.seen;
    marks.replaceChildren();
    marks.setAttribute('viewBox', `0 0 ${size.join(' ')}`);
    if (!pixel || !this.active) return;
    const unit = size[1] / 400;
    const [x, y] = [pixel[0] + 0.5, pixel[1] + 0.5];
    const line = (to: [number, number], from: [number, number], kind: string) =>
      marks.append(svgElement('line', { x1: from[0], y1: from[1], x2: to[0], y2: to[1], class: kind, 'stroke-width': 1.5 * unit }));
    const point = ([cx, cy]: [number, number], r: number, kind: string, title: string) => {
      const circle = svgElement('circle', { cx, cy, r: r * unit, class: kind, 'stroke-width': 1.5 * unit });
      circle.append(svgElement('title', {}, title));
      marks.append(circle);
    };
    for (const note of seen?.notes ?? []) {
      if (!note.pixel) continue;
      const at: [number, number] = [note.pixel[0] + 0.5, note.pixel[1] + 0.5];
      if (note.kind === 'rejected') point(at, 3, 'rejected', 'a neighbour that is too different');
      else if (note.kind === 'domain' && (note.pixel[0] !== pixel[0] || note.pixel[1] !== pixel[1] || note.stage === 'temporal')) {
        const kind = note.stage === 'temporal' ? 'history' : 'neighbour';
        line(at, [x, y], kind);
        point(at, 4, kind, `${kind}: pixel ${note.pixel.join(', ')}`);
      }
    }
    if (seen?.surface) this.drawSamples(seen, seen.surface.position, line, point);
    marks.append(svgElement('rect', { x: x - 5 * unit, y: y - 5 * unit, width: 10 * unit, height: 10 * unit, class: 'pixel', 'stroke-width': 1.5 * unit }));
  }

  private drawSamples(
    seen: Inspection,
    from: Vector,
    line: (to: [number, number], from: [number, number], kind: string) => void,
    point: (at: [number, number], radius: number, kind: string, title: string) => void,
  ): void {
    const camera = this.view.camera();
    const place = ({ sample }: Note) => {
      if (!sample) return undefined;
      const far = Math.min(sample.distance, 1e4);
      const to = from.map((value, at) => value + far * (sample.direction[at] ?? 0)) as Vector;
      return projectLine(camera, this.size, from, to);
    };
    for (const note of this.heaviest(seen)) {
      const drawn = place(note);
      if (drawn && note.resampling_weight > 0) point(drawn[1], 2.5, 'candidate', `a candidate: ${lightName(note)}`);
    }
    const last = lastResult(seen);
    const drawn = last && place(last);
    if (!last || !drawn) return;
    const kind = last.is_visible && last.unbiased_contribution_weight > 0 ? 'chosen' : 'shadowed';
    line(drawn[1], drawn[0], kind);
    point(drawn[1], 4, kind, `${kind}: ${lightName(last)}`);
  }
}
