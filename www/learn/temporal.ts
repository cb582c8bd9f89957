// A pixel that joins what it kept in the frame before, and what that does to its noise, in closed form.
import type { Random } from './random.js';
import { Reservoir } from './reservoir.js';
import { type Light, arriving, total } from './resampling.js';

/** One light, drawn evenly: what the pixel finds by itself in a frame, as a sample and its contribution weight. */
interface Kept {
  light: Light;
  weight: number;
  confidence: number;
}

/** The share that a frame's own sample has beside its history: 1 / (1 + history), where the history is capped. */
const ownShare = (frame: number, cap: number) => 1 / (1 + Math.min(frame, cap));

/**
 * Estimates of `frames` frames in a row. Each frame draws one light of its own and joins the history of confidence at most `cap`,
 * with the weights m = c / C. Nothing moves, so both could have made every sample, and that is unbiased.
 */
export function chain(lights: readonly Light[], frames: number, cap: number, random: Random): number[] {
  let history: Kept | undefined;
  return Array.from({ length: frames }, () => {
    const light = lights[random.index(lights.length)] as Light;
    const past = Math.min(history?.confidence ?? 0, cap);
    const confidence = past + 1;
    const reservoir = new Reservoir<Light>();
    reservoir.update(light, (1 / confidence) * arriving(light) * lights.length, random);
    if (history && past > 0) reservoir.update(history.light, (past / confidence) * arriving(history.light) * history.weight, random);
    const kept = reservoir.sample ?? light;
    const value = arriving(kept);
    history = { light: kept, weight: value > 0 ? reservoir.weightSum / value : 0, confidence };
    return value * history.weight;
  });
}

/** Variance of what one frame finds by itself. */
export function ownVariance(lights: readonly Light[]): number {
  return lights.length * lights.reduce((sum, light) => sum + arriving(light) ** 2, 0) - total(lights) ** 2;
}

/** How much each frame's own sample counts in the estimate of each frame: row = frame of the estimate. */
function shares(frames: number, cap: number): number[][] {
  const rows: number[][] = [];
  for (let frame = 0; frame < frames; frame++) {
    const own = ownShare(frame, cap);
    const before = rows[frame - 1] ?? [];
    rows.push([...before.map((share) => share * (1 - own)), own]);
  }
  return rows;
}

const squares = (values: readonly number[]) => values.reduce((sum, value) => sum + value * value, 0);

/** Exact standard deviation of each frame's estimate. */
export const frameDeviations = (lights: readonly Light[], frames: number, cap: number) =>
  shares(frames, cap).map((row) => Math.sqrt(ownVariance(lights) * squares(row)));

/** Exact standard deviation of the mean of all frames' estimates. */
export function meanDeviation(lights: readonly Light[], frames: number, cap: number): number {
  const sums = new Array<number>(frames).fill(0);
  for (const row of shares(frames, cap)) row.forEach((share, at) => (sums[at] = (sums[at] as number) + share / frames));
  return Math.sqrt(ownVariance(lights) * squares(sums));
}
