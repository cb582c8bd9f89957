// How many pixels to render: the window's, times a scale that gives way where frames take too long.
import { FrameBudget } from './frame-budget.js';

/** WebGPU's default limit on a texture's side. */
export const longestSide = 8192;
/** Milliseconds that a frame may take where nothing else is asked for. */
export const defaultBudget = 100;
/** Milliseconds after its last movement that the camera counts as resting: a wheel moves it in steps. */
const restAfter = 150;

export class Resolution {
  /** What the user asked for; undefined adapts. */
  fixedSize: [number, number] | undefined;
  fixedScale: number | undefined;
  private readonly automatic = new FrameBudget();
  private movedAt = -Infinity;
  private inMotion = false;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  /** The scale to start from where the user has set none. */
  startAt(scale: number): void {
    this.automatic.startAt(scale);
  }

  /** Another scene: what frames took says nothing about what comes. */
  forget(): void {
    this.automatic.forget();
  }

  /** Milliseconds that a frame may take. */
  set budget(milliseconds: number) {
    if (milliseconds === this.automatic.milliseconds) return;
    this.automatic.milliseconds = milliseconds;
    this.automatic.forget();
  }

  /** Whether the scale adapts. */
  get adapts(): boolean {
    return !this.fixedSize && this.fixedScale === undefined;
  }

  /** The camera moves: until it rests, frames come in time rather than sharp. */
  move(): void {
    this.movedAt = performance.now();
  }

  /** Width and height to render, in pixels. */
  size(): [number, number] {
    if (this.fixedSize) return this.fixedSize;
    this.inMotion = performance.now() - this.movedAt < restAfter;
    const scale = (this.fixedScale ?? this.automatic.scale(this.inMotion)) * devicePixelRatio;
    const side = (length: number) => Math.min(Math.max(Math.round(length * scale), 1), longestSide);
    return [side(this.canvas.clientWidth), side(this.canvas.clientHeight)];
  }

  /** Takes note of the time of a frame with the last `size`. */
  observe(milliseconds: number): void {
    if (this.adapts) this.automatic.observe(milliseconds, this.inMotion);
  }
}
