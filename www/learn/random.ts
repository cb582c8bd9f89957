// Random numbers that are the same in every browser, so that a seed is a run.

/** Numbers even in [0, 1), by the generator mulberry32; the same seed gives the same sequence. */
export class Random {
  private state: number;

  constructor(seed: number) {
    this.state = seed >>> 0;
  }

  next(): number {
    this.state = (this.state + 0x6d2b79f5) >>> 0;
    let word = this.state;
    word = Math.imul(word ^ (word >>> 15), word | 1);
    word ^= word + Math.imul(word ^ (word >>> 7), word | 61);
    return ((word ^ (word >>> 14)) >>> 0) / 2 ** 32;
  }

  /** A whole number from 0 to `count` - 1, all alike. */
  index(count: number): number {
    return Math.floor(this.next() * count);
  }
}
