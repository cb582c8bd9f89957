// One frame in flight, and nobody else on the viewer while it is: every other call waits in a queue between frames.
import type { Viewer } from './pkg/restir.js';

interface Work {
  run(viewer: Viewer): Promise<void>;
  refuse(reason: unknown): void;
}

/** Milliseconds after which other work of the page comes first. */
const slice = 8;

/**
 * Renders a frame and presents it, and waits for the device. Pipelines that it waits for are asked for one by one, and the page draws and
 * listens meanwhile; `making` is told how many of how many the device has compiled, also where there are none. A frame that is `dissected`
 * leaves what its passes wrote with the viewer.
 */
export async function renderFrame(viewer: Viewer, making: (made: number, all: number) => void = () => undefined, dissected = false): Promise<void> {
  let began = performance.now();
  const all = dissected ? viewer.begin_dissected() : viewer.begin();
  making(0, all);
  let made = 0;
  const compiled: Promise<void>[] = [];
  for (let asked = 0; asked < all; asked++) {
    if (performance.now() - began >= slice) {
      await new Promise((resolve) => setTimeout(resolve));
      began = performance.now();
    }
    // Not waited for here: the device shall never wait for the page.
    compiled.push((viewer.make_pipeline() as Promise<void>).then(() => making(++made, all)));
  }
  viewer.finish();
  await Promise.all([...compiled, viewer.idle()]);
}

const nextAnimationFrame = () => new Promise<number>((resolve) => requestAnimationFrame(resolve));

export interface LoopEvents {
  /** Before each frame, with the seconds since the last call. Returns whether the picture must change. */
  beforeFrame(viewer: Viewer, seconds: number): boolean;
  /** While a frame waits for its pipelines: so many of all it needs are compiled. Once with 0 and 0 where it does not wait. */
  making(made: number, all: number): void;
  /** After each frame, with the milliseconds from its first command to an idle device. */
  afterFrame(viewer: Viewer, milliseconds: number): void;
  /** A frame failed. The loop has let go of the viewer. */
  failed(error: unknown): void;
}

export class RenderLoop {
  paused = false;
  /** While nobody sees the picture no frame is rendered; calls are still made. */
  suspended = false;
  /** While someone else renders by calls no frame is rendered either. */
  held = false;
  /** Stops after so many accumulated frames, until something changes. */
  frameLimit = Infinity;
  private viewer: Viewer | undefined;
  private readonly queue: Work[] = [];
  /** Each of a frame of its own. */
  private readonly dissections: Work[] = [];
  private changed = false;
  /** Why there will be no viewer, until one is attached all the same. */
  private stopped: unknown;
  private ended = false;
  /** Frames since the last change: where frames are not averaged, the viewer's own count stays at 1. */
  private frames = 0;

  private readonly running: Promise<void>;

  constructor(private readonly events: LoopEvents) {
    this.running = this.run();
  }

  /** Renders with `viewer` from now on. */
  attach(viewer: Viewer): void {
    this.viewer = viewer;
    this.stopped = undefined;
    this.changed = true;
  }

  /** Rejects with `reason` all calls that wait, and those to come. */
  stop(reason: unknown): void {
    this.stopped = reason;
    for (const { refuse } of [...this.queue.splice(0), ...this.dissections.splice(0)]) refuse(reason);
  }

  /** Stops for good. Resolves when nothing uses the viewer any more. */
  async end(reason: unknown): Promise<void> {
    this.ended = true;
    this.stop(reason);
    await this.running;
  }

  /** Renders one frame even while paused. */
  step(): void {
    this.changed = true;
  }

  /** Runs `work` between two frames. Resolves or rejects as `work` does. */
  call<T>(work: (viewer: Viewer) => T | Promise<T>): Promise<T> {
    return this.enqueue(this.queue, work);
  }

  private enqueue<T>(queue: Work[], work: (viewer: Viewer) => T | Promise<T>): Promise<T> {
    if (this.stopped !== undefined) return Promise.reject(this.stopped);
    return new Promise((resolve, refuse) => {
      const run = async (viewer: Viewer) => {
        try {
          resolve(await work(viewer));
        } catch (error) {
          // The frame that follows tells of a lost device, which nothing else looks after.
          if ((error as { code?: unknown } | undefined)?.code === 'DEVICE') this.changed = true;
          refuse(error);
        }
      };
      queue.push({ run, refuse });
    });
  }

  /** As `call`, for what makes the picture start again: renders a frame even while paused. */
  change<T>(work: (viewer: Viewer) => T | Promise<T>): Promise<T> {
    return this.call(async (viewer) => {
      const result = await work(viewer);
      // What failed has changed nothing.
      this.changed = true;
      return result;
    });
  }

  /** Renders the next frame dissected, even while paused. Resolves to what `read` makes of it before another one is rendered. */
  dissect<T>(read: (viewer: Viewer) => Promise<T>): Promise<T> {
    return this.enqueue(this.dissections, read);
  }

  /** Whether the picture has as many frames as it shall have. */
  isComplete(viewer: Viewer): boolean {
    return Math.max(viewer.frames(), this.frames) >= this.frameLimit;
  }

  private async run(): Promise<void> {
    let last = performance.now();
    while (!this.ended) {
      const now = await nextAnimationFrame();
      const seconds = Math.min(Math.max(now - last, 0) / 1000, 0.1);
      last = now;
      if (this.viewer && !this.ended) await this.turn(this.viewer, seconds);
    }
  }

  private async turn(viewer: Viewer, seconds: number): Promise<void> {
    try {
      for (let work = this.queue.shift(); work; work = this.queue.shift()) await work.run(viewer);
      if (this.suspended || this.held) return;
      const changed = this.events.beforeFrame(viewer, seconds) || this.changed;
      const dissection = this.dissections.shift();
      if (changed) this.frames = 0;
      else if (!dissection && (this.paused || this.isComplete(viewer))) return;
      this.changed = false;
      this.frames += 1;
      const start = performance.now();
      try {
        await renderFrame(viewer, this.events.making, dissection !== undefined);
      } catch (error) {
        if (!dissection) throw error;
        dissection.refuse(error);
        // There may be no room for its pictures; the next frame does without, or tells of a lost device.
        this.changed = true;
        return;
      }
      this.events.afterFrame(viewer, performance.now() - start);
      await dissection?.run(viewer);
    } catch (error) {
      this.viewer = undefined;
      this.events.failed(error);
    }
  }
}
