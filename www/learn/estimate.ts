// The mean of many runs, and how far it can be trusted.

/** A running mean with its standard error (Welford's recurrence, which loses no digits over many runs). */
export class Estimate {
  count = 0;
  mean = 0;
  private squares = 0;

  add(value: number): void {
    this.count += 1;
    const step = value - this.mean;
    this.mean += step / this.count;
    this.squares += step * (value - this.mean);
  }

  /** Variance of one run; NaN before the second. */
  get variance(): number {
    return this.count > 1 ? this.squares / (this.count - 1) : NaN;
  }

  /** Standard deviation of one run. */
  get deviation(): number {
    return Math.sqrt(this.variance);
  }

  /** Standard deviation of the mean. */
  get error(): number {
    return Math.sqrt(this.variance / this.count);
  }
}
