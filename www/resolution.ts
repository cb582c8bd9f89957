// How many pixels to render: the window's, times a scale that gives way where frames take too long.

const slowest = 0.25;
const slowFrame = 100;
/** WebGPU's default limit on a texture's side. */
export const longestSide = 8192;

export class Resolution {
  /** What the user asked for; undefined adapts. */
  fixedSize: [number, number] | undefined;
  fixedScale: number | undefined;
  private automatic = 1;
  private slowFrames = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  /** The scale to start from where the user has set none. */
  startAt(scale: number): void {
    this.automatic = scale;
  }

  /** Width and height to render, in pixels. */
  size(): [number, number] {
    if (this.fixedSize) return this.fixedSize;
    const scale = (this.fixedScale ?? this.automatic) * devicePixelRatio;
    const side = (length: number) => Math.min(Math.max(Math.round(length * scale), 1), longestSide);
    return [side(this.canvas.clientWidth), side(this.canvas.clientHeight)];
  }

  /** Takes note of a frame's time. The first frames of a scene compile shaders: one slow frame is no reason. */
  observe(milliseconds: number): void {
    if (this.fixedSize || this.fixedScale !== undefined) return;
    this.slowFrames = milliseconds > slowFrame ? this.slowFrames + 1 : 0;
    if (this.slowFrames < 4 || this.automatic <= slowest) return;
    // Time goes with the number of pixels, so with the square of the scale.
    this.automatic = Math.max(slowest, this.automatic * Math.max(0.5, Math.sqrt(slowFrame / milliseconds)));
    this.slowFrames = 0;
  }
}
