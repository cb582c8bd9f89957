// Weighted reservoir sampling: one of a stream is kept, in proportion to its weight, and only one is ever remembered.
import type { Random } from './random.js';

/** A reservoir of one sample (002, section 3.2). */
export class Reservoir<Sample> {
  /** The one that is kept; undefined while no weight was above 0. */
  sample: Sample | undefined;
  weightSum = 0;
  /** How many have gone by. */
  count = 0;

  /** Takes one of the stream: it replaces what is kept with probability weight / weightSum. True if it did. */
  update(sample: Sample, weight: number, random: Random): boolean {
    this.count += 1;
    this.weightSum += weight;
    const replaces = random.next() * this.weightSum < weight;
    if (replaces) this.sample = sample;
    return replaces;
  }
}

/** The probability with which each is kept in the end: its weight over the sum of all, whatever the order. */
export function keptProbabilities(weights: readonly number[]): number[] {
  const sum = weights.reduce((total, weight) => total + weight, 0);
  return weights.map((weight) => (sum > 0 ? weight / sum : 0));
}

/** Sends the whole stream through a reservoir and returns the index of the one that is kept. */
export function keepOne(weights: readonly number[], random: Random): number | undefined {
  const reservoir = new Reservoir<number>();
  weights.forEach((weight, index) => reservoir.update(index, weight, random));
  return reservoir.sample;
}
