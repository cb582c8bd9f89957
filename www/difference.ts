// The picture against another one, pixel by pixel: a map over the canvas, of the signed difference or of FLIP.
import { type Picture, flipOf } from './measure.js';
import { byId } from './notices.js';
import type { Compare } from './compare.js';
import { luminance } from './vectors.js';
import type { RestirViewer } from './viewer.js';

/** Milliseconds between two maps: each reads pictures back. */
const interval = 500;

/** Magma of matplotlib (CC0), at nine even steps. */
const magma = [[0, 0, 4], [28, 16, 68], [79, 18, 123], [129, 37, 129], [181, 54, 122], [229, 80, 100], [251, 135, 97], [254, 194, 135], [252, 253, 191]] as const;

type Rgb = [number, number, number];

/** A colour for 0 to 1. */
function magmaOf(value: number): Rgb {
  const place = Math.min(Math.max(value, 0), 1) * (magma.length - 1);
  const low = Math.min(Math.floor(place), magma.length - 2);
  return [0, 1, 2].map((at) => (magma[low]?.[at] ?? 0) + (place - low) * ((magma[low + 1]?.[at] ?? 0) - (magma[low]?.[at] ?? 0))) as Rgb;
}

/** Red where brighter than the other, blue where darker, black where equal; small differences are drawn out by a root. */
function signedOf(value: number): Rgb {
  const size = 255 * Math.sqrt(Math.min(Math.abs(value), 1));
  return value > 0 ? [size, size * 0.35, size * 0.1] : [size * 0.1, size * 0.5, size];
}

const luminanceAt = ({ pixels }: Picture, at: number) => luminance([pixels[3 * at] ?? 0, pixels[3 * at + 1] ?? 0, pixels[3 * at + 2] ?? 0]);

/** Signed difference of luminance over the sum of both, -1 to 1 for each pixel. */
function signedDifference(picture: Picture, other: Picture): Float32Array {
  return Float32Array.from({ length: picture.width * picture.height }, (_, at) => {
    const [a, b] = [luminanceAt(picture, at), luminanceAt(other, at)];
    return (a - b) / (a + b + 0.01);
  });
}

export class Difference {
  private readonly menu = byId('difference', HTMLSelectElement);
  private readonly canvas = byId('map', HTMLCanvasElement);
  private readonly words = byId('difference-words', HTMLElement);
  /** When the next map may be made. */
  private timer = 0;
  private last = 0;
  private busy = false;

  constructor(
    private readonly view: RestirViewer,
    private readonly compare: Compare,
  ) {
    this.menu.addEventListener('change', () => this.update());
    for (const event of ['sample', 'load', 'camera-change'] as const) view.addEventListener(event, () => this.update());
  }

  /** Picture B has come, gone or changed. */
  update(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.show(), Math.max(0, this.last + interval - performance.now()));
  }

  /** Picture B where there is one, else the reference. */
  private async other(): Promise<Picture | undefined> {
    const { other } = this.compare;
    return other?.scene ? other.readPicture() : this.view.reference;
  }

  private async show(): Promise<void> {
    const kind = this.menu.value;
    if (kind === '') {
      this.canvas.hidden = this.words.hidden = true;
      return;
    }
    // What is asked for meanwhile is made afterwards.
    if (this.busy) return this.update();
    this.busy = true;
    this.last = performance.now();
    try {
      const [picture, other] = await Promise.all([this.view.readPicture(), this.other()]);
      if (!other) return this.say('Keep a reference, or compare with a second picture.');
      if (picture.width !== other.width || picture.height !== other.height) return this.say('The two are of different sizes.');
      if (picture.view !== other.view) return this.say(`The one shows ${picture.view}, the other ${other.view}.`);
      const values = kind === 'flip' ? await flipOf(picture, other) : signedDifference(picture, other);
      if (this.menu.value !== kind) return;
      const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
      const against = this.compare.other ? 'picture B' : 'the reference';
      this.say(kind === 'flip' ? `FLIP against ${against}: mean ${mean.toFixed(4)}; black 0, yellow 1` : `Against ${against}: red is brighter, blue is darker, black is equal`);
      this.draw(picture, values, kind === 'flip' ? magmaOf : signedOf);
    } catch (error) {
      this.say((error as Error).message);
    } finally {
      this.busy = false;
    }
  }

  /** Tells something; a map that is older than the words is taken away. */
  private say(text: string): void {
    this.words.textContent = text;
    this.words.hidden = false;
    this.canvas.hidden = true;
  }

  private draw({ width, height }: Picture, values: Float32Array, color: (value: number) => Rgb): void {
    const image = new ImageData(width, height);
    for (const [at, value] of values.entries()) image.data.set([...color(value), 255], 4 * at);
    Object.assign(this.canvas, { width, height, hidden: false });
    this.canvas.getContext('2d')?.putImageData(image, 0, 0);
  }
}
