// How sharp a picture may be so that its frames keep a budget of time. Pure arithmetic: it is told what frames took.

/** The lowest scale at rest, and while the camera moves. */
const [least, leastMoving] = [0.25, 0.1];
/** So many slow frames in a row are a reason to render fewer pixels: the first ones of a scene compile shaders. */
const slowFrames = 4;
/** So many fast ones to render more, at first and at most. */
const [fastFrames, mostFastFrames] = [8, 1024];
/** A frame is fast that leaves so much room: between this and the budget nothing changes. */
const room = 0.6;
/** What a change aims at. */
const aim = 0.8;

const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);

/** Scales of a picture at rest and in motion, along one side; 1 is a pixel of the device. */
export class FrameBudget {
  /** Milliseconds that a frame may take. */
  milliseconds = 100;
  private rest = 1;
  private moving = 1;
  private slow = 0;
  private fast = 0;
  /** Fast frames it takes to rise: twice as many each time that a rise had to be taken back, so that it settles. */
  private patience = fastFrames;
  private risen = false;
  /** Of the last frame at rest. */
  private last = 0;

  /** Begins with a scale. */
  startAt(scale: number): void {
    this.rest = this.moving = scale;
    this.forget();
  }

  /** What frames took says nothing about what comes: another budget, another scene. */
  forget(): void {
    this.slow = this.fast = this.last = 0;
    this.patience = fastFrames;
    this.risen = false;
  }

  /** The scale to render with. */
  scale(inMotion: boolean): number {
    return inMotion ? Math.min(this.moving, this.rest) : this.rest;
  }

  /** Takes note of what a frame took. */
  observe(milliseconds: number, inMotion: boolean): void {
    if (inMotion) this.observeMoving(milliseconds);
    else this.observeStill(milliseconds);
  }

  private observeStill(milliseconds: number): void {
    this.slow = milliseconds > this.milliseconds ? this.slow + 1 : 0;
    this.fast = milliseconds < room * this.milliseconds ? this.fast + 1 : 0;
    // One slow frame among others is no reason to blur the next movement.
    const usual = Math.min(milliseconds, this.last || milliseconds);
    this.last = milliseconds;
    this.moving = usual > this.milliseconds ? clamp(this.fitting(this.rest, usual, aim), leastMoving, this.rest) : this.rest;
    if (this.slow >= slowFrames) this.sink(milliseconds);
    else if (this.fast >= this.patience) this.rise(milliseconds);
  }

  private sink(milliseconds: number): void {
    if (this.risen) this.patience = Math.min(2 * this.patience, mostFastFrames);
    this.risen = false;
    this.slow = 0;
    this.rest = clamp(this.fitting(this.rest, milliseconds, 1), Math.min(least, this.rest), this.rest);
  }

  private rise(milliseconds: number): void {
    this.fast = 0;
    if (this.rest >= 1) return;
    this.risen = true;
    this.rest = clamp(this.fitting(this.rest, milliseconds, aim), this.rest, 1);
  }

  /** At once: nobody waits for four slow frames of a picture that follows the hand. */
  private observeMoving(milliseconds: number): void {
    this.fast = milliseconds < room * this.milliseconds ? this.fast + 1 : 0;
    const from = this.scale(true);
    if (milliseconds > this.milliseconds) this.moving = Math.max(this.fitting(from, milliseconds, aim), Math.min(leastMoving, from));
    else if (this.fast >= fastFrames) {
      this.fast = 0;
      this.moving = Math.min(this.fitting(from, milliseconds, aim), this.rest);
    }
  }

  /** The scale that fills a part of the budget where `scale` takes so long: time goes with the pixels. At most half and twice as many a side. */
  private fitting(scale: number, milliseconds: number, part: number): number {
    return scale * clamp(Math.sqrt((part * this.milliseconds) / Math.max(milliseconds, 0.1)), 0.5, 2);
  }
}
