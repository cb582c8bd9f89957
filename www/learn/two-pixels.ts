// Two pixels under a row of lights, with a board between them and the lights: what one sees the other may not.
import type { Random } from './random.js';
import { Reservoir } from './reservoir.js';

/** A point of the picture plane; the floor is y = 0. */
export interface Point {
  x: number;
  y: number;
}

export interface Board {
  left: number;
  right: number;
  y: number;
}

export interface Lamp extends Point {
  power: number;
}

export const pixelA: Point = { x: -1, y: 0 };
export const pixelB: Point = { x: 1, y: 0 };

export const lamps: readonly Lamp[] = [-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5].map((x, at) => ({ x, y: 3, power: [4, 6, 3, 8, 5, 7, 4, 6][at] as number }));

/** The board with its middle at `x`. */
export const boardAt = (x: number): Board => ({ left: x - 0.75, right: x + 0.75, y: 1.2 });

/** Whether nothing stands between the pixel and the lamp. */
export function sees(pixel: Point, lamp: Point, board: Board): boolean {
  const crossing = pixel.x + ((lamp.x - pixel.x) * board.y) / lamp.y;
  return crossing < board.left || crossing > board.right;
}

/** The light that arrives from a lamp: power × cosine / distance², if it is seen. Here it is the target function, too. */
export function target(pixel: Point, lamp: Lamp, board: Board): number {
  const [x, y] = [lamp.x - pixel.x, lamp.y];
  const squared = x * x + y * y;
  return sees(pixel, lamp, board) ? (lamp.power * y) / squared ** 1.5 : 0;
}

/** Target functions by pixel and lamp; pixel 0 is the one that joins the others' samples. */
export type Targets = readonly (readonly number[])[];

export const targetsFor = (pixels: readonly Point[], board: Board): Targets =>
  pixels.map((pixel) => lamps.map((lamp) => target(pixel, lamp, board)));

/** How samples of several pixels are weighted, all with the same confidence. */
export type Weighting = 'constant' | '1/z' | 'balance' | 'pairwise' | 'defensive';

/** The weight that pixel `i`'s sample has if it is lamp `y`: m_i(y). Its sum over all pixels is 1, except for `constant` over those that can make y. */
export function reuseWeight(weighting: Weighting, targets: Targets, i: number, y: number): number {
  const values = targets.map((ofPixel) => ofPixel[y] as number);
  const [own, count] = [values[0] as number, values.length];
  const value = values[i] as number;
  const share = (part: number, whole: number) => (whole > 0 ? part / whole : 0);
  switch (weighting) {
    case 'constant':
      return 1 / count;
    case '1/z':
      return value > 0 ? 1 / values.filter((other) => other > 0).length : 0;
    case 'balance':
      return share(value, values.reduce((sum, other) => sum + other, 0));
    case 'pairwise':
    case 'defensive': {
      const others = count - 1;
      const pairs = i === 0
        ? values.slice(1).reduce((sum, other) => sum + share(own, own + others * other), 0) / others
        : share(value, own + others * value);
      if (weighting === 'pairwise') return pairs;
      return (others / count) * pairs + (i === 0 ? 1 / count : 0);
    }
  }
}

/** The light that arrives at pixel 0. */
export const trueValue = (targets: Targets) => (targets[0] as readonly number[]).reduce((sum, value) => sum + value, 0);

/**
 * The expected value of the joined estimate, exactly: each lamp counts with the sum of the weights of those pixels that can make it
 * (002, Eq. 26; 004, Eq. 6.17).
 */
export function expectedValue(weighting: Weighting, targets: Targets): number {
  return lamps.reduce((sum, _, y) => {
    const makers = targets.map((ofPixel, i) => ((ofPixel[y] as number) > 0 ? reuseWeight(weighting, targets, i, y) : 0));
    return sum + ((targets[0] as readonly number[])[y] as number) * makers.reduce((all, weight) => all + weight, 0);
  }, 0);
}

/** What a pixel keeps of its own candidates. */
export interface Kept {
  lamp: number;
  /** Unbiased contribution weight. */
  weight: number;
}

/** One pixel's own resampling: `candidates` lamps, all alike, one kept by the target function. Undefined if none was seen. */
export function ownSample(values: readonly number[], candidates: number, random: Random): Kept | undefined {
  const reservoir = new Reservoir<number>();
  for (let at = 0; at < candidates; at++) {
    const lamp = random.index(values.length);
    reservoir.update(lamp, ((values[lamp] as number) * values.length) / candidates, random);
  }
  const lamp = reservoir.sample;
  return lamp === undefined ? undefined : { lamp, weight: reservoir.weightSum / (values[lamp] as number) };
}

/** One joined estimate at pixel 0, and which sample it shades: w_i = m_i p_0 W_i, one is kept, f W = p_0(y) × sum / p_0(y). */
export function join(weighting: Weighting, targets: Targets, samples: readonly (Kept | undefined)[], random: Random): { value: number; kept: number | undefined } {
  const reservoir = new Reservoir<number>();
  samples.forEach((sample, i) => {
    if (!sample) return;
    const own = (targets[0] as readonly number[])[sample.lamp] as number;
    reservoir.update(i, reuseWeight(weighting, targets, i, sample.lamp) * own * sample.weight, random);
  });
  return { value: reservoir.weightSum, kept: reservoir.sample };
}

/** Each pixel's own sample, then one estimate joined by each of the weightings from those same samples. */
export function runOnce(weightings: readonly Weighting[], targets: Targets, candidates: number, random: Random): { samples: (Kept | undefined)[]; values: number[] } {
  const samples = targets.map((values) => ownSample(values, candidates, random));
  return { samples, values: weightings.map((weighting) => join(weighting, targets, samples, random).value) };
}

/** Pixel A and so many neighbours to its right, half a unit apart. */
export const rowOfPixels = (neighbours: number): Point[] => Array.from({ length: neighbours + 1 }, (_, at) => ({ x: pixelA.x + at / 2, y: 0 }));

/** How often target functions are evaluated to join `count` pixels' samples, the joining pixel's among them. */
export const evaluations = (weighting: Weighting, count: number) =>
  ({ constant: count, '1/z': count ** 2, balance: count ** 2, pairwise: 3 * count - 2, defensive: 3 * count - 2 })[weighting];
