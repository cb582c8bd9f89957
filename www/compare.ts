// A second picture over the first: the same scene, camera and moment with other settings, parted by a divider that can be moved.
import { byId } from './notices.js';
import { type Settings, readQuery, writeQuery } from './url-state.js';
import { type Change, RestirViewer } from './viewer.js';

/** What of the settings is of a picture alone; all else is shared. */
const own = ({ technique, view, values }: Settings): Partial<Settings> => ({ technique, view, values });

export class Compare {
  private second: RestirViewer | undefined;
  /** The second picture's latest change of scene. */
  private following: Promise<void> = Promise.resolve();
  /** Percent of the width that shows the first picture. */
  private share = 50;
  private readonly divider = byId('divider', HTMLElement);

  constructor(
    private readonly first: RestirViewer,
    /** A setting of the second picture's has changed, or it has come or gone. */
    private readonly changed: (change?: Change) => void,
  ) {
    const { divider } = this;
    divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener('pointermove', (event) => {
      if (divider.hasPointerCapture(event.pointerId)) this.part((100 * event.clientX) / innerWidth);
    });
    divider.addEventListener('keydown', (event) => {
      const to = { ArrowLeft: this.share - 2, ArrowRight: this.share + 2, Home: 0, End: 100 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.part(to);
    });
    first.addEventListener('camera-change', ({ detail }) => void this.second?.setCamera(detail));
    first.addEventListener('load', () => this.follow());
    first.addEventListener('param-change', ({ detail }) => this.pass(detail.name));
  }

  /** The second picture's viewer, while there is one. */
  get other(): RestirViewer | undefined {
    return this.second;
  }

  /** Its settings as a query; undefined where there is none. */
  get query(): string | undefined {
    return this.second && writeQuery({ ...readQuery('').state, ...own(this.second.settings) }).replace(/^\?/, '');
  }

  /** Opens the second picture, with the settings of a query or those of the first. */
  async open(query?: string): Promise<void> {
    if (this.second) return;
    const { first } = this;
    const given = query === undefined ? own({ ...first.settings, values: new Map(first.settings.values) }) : own(readQuery(query).state);
    const canvas = document.createElement('canvas');
    Object.assign(canvas, { id: 'canvas-b', ariaHidden: 'true' });
    byId('canvas', HTMLCanvasElement).after(canvas);
    const second = (this.second = new RestirViewer(canvas, { ...first.settings, ...given }));
    second.addEventListener('param-change', ({ detail }) => this.changed(detail));
    // A fault of the second's is told as the first's are.
    second.addEventListener('error', ({ detail }) => first.dispatchEvent(new CustomEvent('error', { detail })));
    second.addEventListener('sample', ({ detail }) => this.label('b', second, detail.count));
    first.addEventListener('sample', this.labelFirst);
    this.part(50);
    this.divider.hidden = false;
    byId('labels', HTMLElement).hidden = false;
    this.follow();
    await this.following;
    if (first.paused) second.pause();
    this.changed();
  }

  /** Shows the settings of a query in the second picture, which is opened if there is none. */
  async show(query: string): Promise<void> {
    if (!this.second) return this.open(query);
    await this.following;
    await this.second?.show({ ...this.second.settings, ...own(readQuery(query).state) }).catch(() => undefined);
  }

  close(): void {
    if (!this.second) return;
    this.first.removeEventListener('sample', this.labelFirst);
    this.second?.dispose();
    this.second = undefined;
    document.getElementById('canvas-b')?.remove();
    this.divider.hidden = true;
    byId('labels', HTMLElement).hidden = true;
    this.changed();
  }

  /** Shows the other picture alone, or both again. */
  flip(): void {
    this.part(this.share === 100 ? 0 : this.share === 0 ? 50 : 100);
  }

  private readonly labelFirst = (event: Event) => this.label('a', this.first, (event as CustomEvent<{ count: number }>).detail.count);

  private label(side: 'a' | 'b', { settings }: RestirViewer, frames: number): void {
    const view = settings.view === 'radiance' ? '' : `, ${settings.view}`;
    byId(`label-${side}`, HTMLElement).textContent = `${side.toUpperCase()}: ${settings.technique}${view}, ${frames} ${frames === 1 ? 'frame' : 'frames'}`;
  }

  private follow(): void {
    if (this.second) this.following = this.second.showAs(this.first).catch(() => undefined);
  }

  private part(share: number): void {
    this.share = Math.min(Math.max(share, 0), 100);
    const { style } = document.documentElement;
    style.setProperty('--divider', `${this.share}%`);
    this.divider.setAttribute('aria-valuenow', String(Math.round(this.share)));
  }

  /** Gives the second picture what both share. */
  private pass(name: string): void {
    const { first, second } = this;
    if (!second) return;
    const { seed, time, speed, animation, accumulate, scale, frames, size } = first.settings;
    const shared: Record<string, () => Promise<void>> = {
      seed: () => second.setSeed(seed),
      time: () => second.setTime(time),
      speed: () => second.setSpeed(speed),
      animation: () => second.setAnimation(animation),
      accumulate: () => second.setAccumulate(accumulate),
      scale: () => second.setScale(scale),
      frames: () => second.setMaxSamples(frames),
      size: () => second.setSize(size),
    };
    for (const each of name === 'settings' ? Object.keys(shared) : [name]) void shared[each]?.();
  }
}
