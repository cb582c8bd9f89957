// <restir-viewer>: a RestirViewer as an element, told by attributes what to show.
import { Compare } from './compare.js';
import { explain, toFailure } from './messages.js';
import { defaultTechnique, poseOf, timeOf } from './url-state.js';
import { type LoadOptions, type Pose, RestirViewer, type ViewerEventMap, type ViewerFailure } from './viewer.js';

export * from './viewer.js';

const css = `
:host { --accent: #f0b35a; --surface: rgb(20 22 26 / 92%); display: block; position: relative; aspect-ratio: 3 / 2; overflow: hidden; background: #0c0d10; color: #e4e2dd; font: 14px/1.45 system-ui, sans-serif; }
:host([hidden]), [hidden] { display: none !important; }
canvas, img { position: absolute; inset: 0; width: 100%; height: 100%; object-fit: contain; }
:host([controls]) canvas { touch-action: none; cursor: grab; }
canvas:focus-visible { outline: 2px solid var(--accent); outline-offset: -2px; }
progress { position: absolute; inset: auto 0 0; width: 100%; height: 3px; appearance: none; border: 0; background: none; color: var(--accent); }
progress::-webkit-progress-bar { background: none; }
progress::-webkit-progress-value { background: var(--accent); }
progress::-moz-progress-bar { background: var(--accent); }
p { position: absolute; inset: auto 0.5rem 0.5rem; margin: 0; padding: 0.5rem 0.75rem; border-radius: 6px; background: var(--surface); }
`;

/** The events that the element passes on. */
const passedOn = ['progress', 'load', 'sample', 'camera-change', 'param-change', 'devicelost', 'restored'] as const;

/** `name=value`, with white space between. */
function parametersOf(text: string | null): Map<string, string> {
  const words = (text ?? '').split(/\s+/).filter((word) => word !== '');
  return new Map(words.map((word): [string, string] => {
    const at = word.indexOf('=');
    if (at < 1) throw { code: 'BAD_VALUE', message: `params: ${word} is not name=value.` };
    return [word.slice(0, at), word.slice(at + 1)];
  }));
}

/** What `read` makes of an attribute; throws `BAD_VALUE`. */
function valueOf<T>(name: string, text: string, read: (text: string) => T): T {
  try {
    return read(text);
  } catch (error) {
    throw { code: 'BAD_VALUE', message: `${name}=${text}: ${(error as Error).message}` };
  }
}

/** Nine numbers are where to stand and look; anything else names one of the scene's cameras. */
const cameraOf = (text: string | null): string | Pose => (text?.includes(',') ? valueOf('camera', text, poseOf) : text || '0');

const momentOf = (text: string | null) => (text === null ? 0 : valueOf('time', text, timeOf));

const numberOf = (text: string | null) => (text === null ? undefined : Number(text));

export interface RestirViewerElement {
  addEventListener<Type extends keyof ViewerEventMap>(
    type: Type,
    listener: (event: ViewerEventMap[Type]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/**
 * Attributes, all live: `src`, `technique`, `params`, `camera`, `environment`, `poster`, `alt`, `controls`, `autoplay`, `time`,
 * `seed`, `scale`, `budget`, `max-samples`, `view`, `compare`. Events are those of `RestirViewer`; they do not bubble. It loads when it first comes into
 * view, renders while it is in view, and ends when it is removed. Style it from outside by its parts: `canvas`, `poster`,
 * `progress`, `message`.
 */
export class RestirViewerElement extends HTMLElement {
  static readonly observedAttributes = [
    'src', 'environment', 'camera', 'time', 'technique', 'params', 'view', 'seed', 'autoplay', 'scale', 'max-samples', 'controls', 'poster', 'alt',
    'compare', 'budget',
  ];

  private readonly root = this.attachShadow({ mode: 'open' });
  private readonly poster = Object.assign(document.createElement('img'), { alt: '' });
  private readonly progress = Object.assign(document.createElement('progress'), { max: 1, value: 0, hidden: true, ariaLabel: 'Loading' });
  private readonly message = document.createElement('p');
  private readonly sight = new IntersectionObserver((entries) => this.seen(entries.at(-1)?.isIntersecting ?? false));
  private canvas: HTMLCanvasElement | undefined;
  private current: RestirViewer | undefined;
  private compare: Compare | undefined;
  /** Values of attributes as they were applied. */
  private readonly applied = new Map<string, string | null>();
  private parameters = new Map<string, string>();
  private applying = false;
  private wasSeen = false;
  private hasPicture = false;
  /** Whether the message is about what is still being loaded: then it stays. */
  private isOfLoad = false;

  constructor() {
    super();
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(css);
    this.root.adoptedStyleSheets = [sheet];
    this.message.hidden = true;
    for (const [name, element] of Object.entries({ poster: this.poster, progress: this.progress, message: this.message })) element.part.add(name);
    this.message.setAttribute('role', 'alert');
    this.root.append(this.poster, this.progress, this.message);
  }

  /** The viewer, for what attributes do not say. Undefined while the element is in no document; another one after each insertion. */
  get viewer(): RestirViewer | undefined {
    return this.current;
  }

  /** The viewer of the second picture, while `compare` shows one. */
  get second(): RestirViewer | undefined {
    return this.compare?.other;
  }

  connectedCallback(): void {
    if (this.current) return;
    this.canvas = document.createElement('canvas');
    this.canvas.part.add('canvas');
    this.root.prepend(this.canvas);
    this.current = new RestirViewer(this.canvas);
    this.compare = new Compare(this.current, this.canvas);
    this.listen(this.current);
    this.applied.clear();
    this.parameters.clear();
    this.wasSeen = this.hasPicture = false;
    this.update();
    this.sight.observe(this);
  }

  disconnectedCallback(): void {
    // An element that is moved is connected again at once.
    queueMicrotask(() => {
      if (this.isConnected) return;
      this.sight.disconnect();
      this.compare?.dispose();
      this.current?.dispose();
      this.current = undefined;
      this.canvas?.remove();
    });
  }

  attributeChangedCallback(): void {
    this.update();
  }

  private listen(viewer: RestirViewer): void {
    viewer.addEventListener('progress', ({ detail }) => {
      this.progress.hidden = false;
      this.progress.value = detail.fraction;
    });
    viewer.addEventListener('load', () => {
      // What was wrong before has nothing to do with what is shown now.
      if (!this.isOfLoad) this.message.hidden = true;
      this.isOfLoad = false;
    });
    viewer.addEventListener('sample', () => {
      this.poster.hidden = this.hasPicture = true;
      // A frame of the former scene ends no load. What the load has just complained of stays.
      if (!viewer.opening) this.progress.hidden = true;
    });
    viewer.addEventListener('restored', () => this.clear());
    viewer.addEventListener('error', ({ detail }) => this.showFailure(detail));
    for (const type of passedOn) {
      viewer.addEventListener(type, (event) => this.dispatchEvent(new CustomEvent(type, { detail: (event as CustomEvent<unknown>).detail })));
    }
  }

  private showFailure(failure: ViewerFailure): void {
    this.isOfLoad = this.current?.opening ?? false;
    const { title, text } = explain(failure);
    this.message.textContent = `${title}: ${text}`;
    this.message.hidden = false;
    this.progress.hidden = true;
    this.dispatchEvent(new CustomEvent('error', { detail: failure }));
  }

  private clear(): void {
    this.progress.hidden = true;
    this.message.hidden = true;
  }

  private seen(isSeen: boolean): void {
    if (!this.current) return;
    for (const viewer of [this.current, this.second]) if (viewer) viewer.suspended = !isSeen;
    if (isSeen && !this.wasSeen) {
      this.wasSeen = true;
      this.update();
    }
  }

  /** Applies what has changed, once for all attributes that change together. */
  private update(): void {
    if (this.applying) return;
    this.applying = true;
    queueMicrotask(() => {
      this.applying = false;
      if (this.current) this.apply(this.current);
    });
  }

  /** Whether one of the attributes has changed since the last time. */
  private changed(...names: string[]): boolean {
    const changed = names.filter((name) => this.applied.get(name) !== this.getAttribute(name) || !this.applied.has(name));
    for (const name of changed) this.applied.set(name, this.getAttribute(name));
    return changed.length > 0;
  }

  private apply(viewer: RestirViewer): void {
    if (this.changed('alt', 'controls', 'poster')) this.applyLooks(viewer);
    if (!this.wasSeen) return;
    this.message.hidden = true;
    this.applyScene(viewer);
    this.applySettings(viewer);
  }

  /** Applies an attribute; what is wrong with it is told, and no reason to leave out others. */
  private attempt(work: () => unknown): void {
    try {
      work();
    } catch (error) {
      this.showFailure(toFailure(error));
    }
  }

  private applyLooks(viewer: RestirViewer): void {
    const { canvas, poster } = this;
    const controls = this.getAttribute('controls');
    viewer.controls = controls === null ? 'none' : controls === 'fly' ? 'fly' : 'orbit';
    canvas?.setAttribute('role', 'img');
    canvas?.setAttribute('aria-label', this.getAttribute('alt') ?? 'Rendered scene');
    if (controls === null) canvas?.removeAttribute('tabindex');
    else canvas?.setAttribute('tabindex', '0');
    const source = this.getAttribute('poster');
    if (source === null) poster.removeAttribute('src');
    else if (poster.getAttribute('src') !== source) poster.src = source;
    poster.hidden = source === null || this.hasPicture;
  }

  private applyScene(viewer: RestirViewer): void {
    const source = this.getAttribute('src');
    if (source === null) return;
    const camera = () => cameraOf(this.getAttribute('camera'));
    const time = () => momentOf(this.getAttribute('time'));
    if (this.changed('src')) {
      const environment = this.getAttribute('environment');
      this.changed('environment', 'camera', 'time');
      const view: LoadOptions = { environment };
      this.attempt(() => {
        const place = camera();
        Object.assign(view, typeof place === 'string' ? { camera: place } : { pose: place });
      });
      this.attempt(() => (view.time = time()));
      // What is wrong with them is of this load, which takes older messages away.
      const isTold = !this.message.hidden;
      viewer.load(source, view).catch(() => (this.progress.hidden = !viewer.opening));
      this.isOfLoad = isTold;
      return;
    }
    if (this.changed('environment')) void viewer.setEnvironment(this.getAttribute('environment'));
    if (this.changed('camera')) this.attempt(() => viewer.setCamera(camera()));
    if (this.changed('time')) this.attempt(() => viewer.setTime(time()));
  }

  private applySettings(viewer: RestirViewer): void {
    const text = (name: string) => this.getAttribute(name);
    if (this.changed('technique')) {
      void viewer.setTechnique(text('technique') ?? defaultTechnique);
      // A technique starts from its defaults, and with the picture where it lacks the view.
      for (const name of ['params', 'view']) if (text(name) !== null) this.applied.delete(name);
      for (const name of this.parameters.keys()) if (!name.includes('.')) this.parameters.delete(name);
    }
    if (this.changed('view')) void viewer.setView(text('view') ?? 'radiance');
    if (this.changed('seed')) void viewer.setSeed(numberOf(text('seed')) ?? 0);
    if (this.changed('autoplay')) void viewer.setAccumulate(text('autoplay') === null ? true : undefined);
    if (this.changed('scale')) void viewer.setScale(numberOf(text('scale')));
    if (this.changed('budget')) void viewer.setBudget(numberOf(text('budget')));
    if (this.changed('max-samples')) void viewer.setMaxSamples(numberOf(text('max-samples')));
    if (this.changed('params')) this.attempt(() => this.applyParameters(viewer));
    if (this.changed('compare')) {
      const second = text('compare');
      if (second === null) this.compare?.close();
      else void this.compare?.show(second);
    }
  }

  private applyParameters(viewer: RestirViewer): void {
    const wanted = parametersOf(this.getAttribute('params'));
    const before = this.parameters;
    this.parameters = wanted;
    // Back to defaults first: the old and the new may contradict each other.
    for (const [name, value] of before) if (wanted.get(name) !== value) void viewer.setParam(name, undefined);
    for (const [name, value] of wanted) if (before.get(name) !== value) viewer.setParam(name, value).catch(() => wanted.delete(name));
  }
}

customElements.define('restir-viewer', RestirViewerElement);

declare global {
  interface HTMLElementTagNameMap {
    'restir-viewer': RestirViewerElement;
  }
}
