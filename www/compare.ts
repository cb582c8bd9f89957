// A second picture over the first: the same scene, camera and moment with other settings, parted by a divider that can be moved.
// A component of its own: it lies over any canvas, of the page or in an element.
import { type Settings, isShared, readQuery, writeQuery } from './url-state.js';
import { type Change, RestirViewer, type ViewerFailure } from './viewer.js';

/** What of the settings is of a picture alone; all else is shared. */
const own = ({ technique, view, values }: Settings): Partial<Settings> => ({ technique, view, values });

const css = `
#canvas-b { pointer-events: none; clip-path: inset(0 0 0 var(--divider)); }
#divider {
  position: absolute;
  top: 0;
  bottom: 0;
  left: calc(var(--divider) - 0.5rem);
  width: 1rem;
  cursor: ew-resize;
  touch-action: none;
  background: linear-gradient(to right, transparent 45%, var(--accent) 45% 55%, transparent 55%);
}
#divider:focus-visible { outline: 2px solid var(--accent); outline-offset: 1px; }
#labels { position: absolute; inset: 0.5rem auto auto 0.5rem; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 0.5rem; pointer-events: none; background: none; }
@media (max-width: 40rem) { #labels { flex-direction: column; align-items: flex-start; } }
#labels span { padding: 0.15rem 0.5rem; background: var(--surface); border-radius: 6px; }
`;

const sheet = new CSSStyleSheet();
sheet.replaceSync(css);

function make<Tag extends keyof HTMLElementTagNameMap>(tag: Tag, attributes: Record<string, string>): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

export class Compare {
  private second: RestirViewer | undefined;
  /** The second picture's latest change of scene. */
  private following: Promise<void> = Promise.resolve();
  /** Percent of the width that shows the first picture. */
  private share = 50;
  private readonly divider = make('div', {
    id: 'divider', part: 'divider', role: 'slider', tabindex: '0', 'aria-label': 'Divider: how much of the width shows picture A', 'aria-valuemin': '0', 'aria-valuemax': '100',
  });
  private readonly labels = make('div', { id: 'labels', part: 'labels' });
  private readonly names = { a: make('span', { id: 'label-a' }), b: make('span', { id: 'label-b' }) };
  private canvas: HTMLCanvasElement | undefined;
  /** To the first picture, until it is disposed of. */
  private readonly listening = new AbortController();

  constructor(
    private readonly first: RestirViewer,
    /** The first picture's. The second one comes over it, as large. */
    private readonly under: HTMLCanvasElement,
    /** A setting of the second picture's has changed, or it has come or gone. */
    private readonly changed: (change?: Change) => void = () => undefined,
  ) {
    const { divider, labels, names } = this;
    labels.append(names.a, names.b);
    divider.hidden = labels.hidden = true;
    under.after(divider, labels);
    const { adoptedStyleSheets } = this.tree;
    if (!adoptedStyleSheets.includes(sheet)) this.tree.adoptedStyleSheets = [...adoptedStyleSheets, sheet];
    divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener('pointermove', (event) => {
      const { left, width } = under.getBoundingClientRect();
      if (divider.hasPointerCapture(event.pointerId)) this.part((100 * (event.clientX - left)) / width);
    });
    divider.addEventListener('keydown', (event) => {
      const to = { ArrowLeft: this.share - 2, ArrowRight: this.share + 2, Home: 0, End: 100 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.part(to);
    });
    const { signal } = this.listening;
    first.addEventListener('camera-change', ({ detail }) => void this.second?.setCamera(detail, { moving: true }), { signal });
    first.addEventListener('load', () => this.follow(), { signal });
    first.addEventListener('param-change', ({ detail }) => this.pass(detail.name), { signal });
    first.addEventListener('sample', ({ detail }) => this.label('a', first, detail.count), { signal });
  }

  /** The second picture's viewer, while there is one. */
  get other(): RestirViewer | undefined {
    return this.second;
  }

  /** Its settings as a query; undefined where there is none. */
  get query(): string | undefined {
    return this.second && writeQuery({ ...readQuery('').state, ...own(this.second.settings) }).replace(/^\?/, '');
  }

  /** Opens the second picture, with the settings of a query or those of the first; as soon as there is a first. */
  async open(query?: string): Promise<void> {
    if (this.second) return;
    const { first } = this;
    const given = query === undefined ? own({ ...first.settings, values: new Map(first.settings.values) }) : this.read(query);
    const canvas = (this.canvas = make('canvas', { id: 'canvas-b', part: 'canvas', 'aria-hidden': 'true' }));
    this.under.after(canvas);
    this.divider.hidden = this.labels.hidden = false;
    const second = (this.second = new RestirViewer(canvas, { ...first.settings, ...given }));
    second.suspended = first.suspended;
    second.addEventListener('param-change', ({ detail }) => this.changed(detail));
    second.addEventListener('error', ({ detail }) => this.tell(detail));
    second.addEventListener('sample', ({ detail }) => this.label('b', second, detail.count));
    this.part(50);
    this.follow();
    await this.following;
    if (first.paused) second.pause();
    this.changed();
  }

  /** Shows the settings of a query in the second picture, which is opened if there is none. */
  async show(query: string): Promise<void> {
    if (!this.second) return this.open(query);
    await this.following;
    const { second } = this;
    const given = this.read(query);
    // Without a scene, it begins with them.
    if (!second?.scene) return void (second && Object.assign(second.settings, given));
    await second.show({ ...second.settings, ...given }).catch(() => undefined);
  }

  /** What a query says of the second picture alone; what it says of both is told, and left out. */
  private read(query: string): Partial<Settings> {
    for (const [key, text] of new URLSearchParams(query)) {
      if (isShared(key)) this.tell({ code: 'BAD_VALUE', message: 'both pictures share it', setting: `${key}=${text}` });
    }
    return own(readQuery(query).state);
  }

  /** A fault of the second's is told as the first's are. */
  private tell({ setting, ...failure }: ViewerFailure): void {
    this.first.dispatchEvent(new CustomEvent('error', { detail: { ...failure, ...(setting !== undefined && { setting: `picture B: ${setting}` }) } }));
  }

  close(): void {
    if (!this.second) return;
    this.second.dispose();
    this.second = undefined;
    this.canvas?.remove();
    this.divider.hidden = this.labels.hidden = true;
    this.changed();
  }

  /** Closes it, and takes away what it put over the first picture. */
  dispose(): void {
    this.close();
    this.listening.abort();
    for (const element of [this.divider, this.labels]) element.remove();
  }

  /** Shows the other picture alone, or both again. */
  flip(): void {
    this.part(this.share === 100 ? 0 : this.share === 0 ? 50 : 100);
  }

  /** Draws the second picture, where it is seen, over the first on a 2-D canvas. */
  async drawOn(context: CanvasRenderingContext2D): Promise<void> {
    const { second, share } = this;
    if (!second?.scene) return;
    const { width, height } = context.canvas;
    context.save();
    context.beginPath();
    context.rect((width * share) / 100, 0, width, height);
    context.clip();
    await second.drawOn(context).finally(() => context.restore());
  }

  /** What the elements are in: the page, or an element's shadow. */
  private get tree(): Document | ShadowRoot {
    const tree = this.under.getRootNode();
    return tree instanceof ShadowRoot ? tree : document;
  }

  private label(side: 'a' | 'b', { settings }: RestirViewer, frames: number): void {
    const view = settings.view === 'radiance' ? '' : `, ${settings.view}`;
    this.names[side].textContent = `${side.toUpperCase()}: ${settings.technique}${view}, ${frames} ${frames === 1 ? 'frame' : 'frames'}`;
  }

  private follow(): void {
    if (this.second && this.first.scene) this.following = this.second.showAs(this.first).catch(() => undefined);
  }

  private part(share: number): void {
    this.share = Math.min(Math.max(share, 0), 100);
    const { tree } = this;
    const holder = tree instanceof ShadowRoot ? (tree.host as HTMLElement) : tree.documentElement;
    holder.style.setProperty('--divider', `${this.share}%`);
    this.divider.setAttribute('aria-valuenow', String(Math.round(this.share)));
  }

  /** Gives the second picture what both share. */
  private pass(name: string): void {
    const { first, second } = this;
    if (!second) return;
    const { seed, time, speed, animation, accumulate, scale, budget, frames, size } = first.settings;
    const shared: Record<string, () => Promise<void>> = {
      seed: () => second.setSeed(seed),
      time: () => second.setTime(time),
      speed: () => second.setSpeed(speed),
      // A scene in which nothing is animated has no animation 0 either.
      animation: async () => void (first.scene?.report.animations.length && (await second.setAnimation(animation))),
      accumulate: () => second.setAccumulate(accumulate),
      scale: () => second.setScale(scale),
      budget: () => second.setBudget(budget),
      frames: () => second.setMaxSamples(frames),
      size: () => second.setSize(size),
    };
    for (const each of name === 'settings' ? Object.keys(shared) : [name]) void shared[each]?.();
  }
}
