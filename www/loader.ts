// Loads a scene in a worker of its own. The worker ends with the load, and its memory with it.
import type { LoadRequest, LoadResponse, Loaded } from './protocol.js';
import type { Stage } from './stages.js';

export type Progress = (stage: Stage, fraction: number, what: string) => void;

export class SceneLoader {
  private worker: Worker | undefined;
  /** Rejects the load that is running. */
  private abandon: ((failure: { code: string; message: string }) => void) | undefined;

  /** Resolves to the scene, or rejects with a `Failure`. A load still running is abandoned: it rejects with CANCELLED. */
  async load(request: Promise<WebAssembly.Module>, rest: Omit<LoadRequest, 'module'>, progress: Progress): Promise<Loaded> {
    this.cancel();
    // Now, so that its scripts load while the wasm module compiles.
    const worker = (this.worker = SceneLoader.spawn());
    return new Promise((resolve, reject) => {
      this.abandon = reject;
      worker.onmessage = ({ data }: MessageEvent<LoadResponse>) => {
        if (data.kind === 'progress') return progress(data.stage, data.fraction, data.what);
        this.end(worker);
        if (data.kind === 'scene') resolve(data);
        else reject(data.failure);
      };
      worker.onerror = (event) => {
        this.end(worker);
        reject({ code: 'WORKER', message: event.message || 'the scene could not be read: out of memory, or the page is incomplete' });
      };
      const send = (module: WebAssembly.Module) => worker.postMessage({ module, ...rest } satisfies LoadRequest);
      request.then(send).catch((error: unknown) => {
        this.end(worker);
        reject(error);
      });
    });
  }

  /** Whether a load is running. */
  get busy(): boolean {
    return this.abandon !== undefined;
  }

  /** Ends the load that is running, if one is. */
  cancel(): void {
    if (!this.abandon) return;
    this.abandon({ code: 'CANCELLED', message: 'Loading was cancelled.' });
    this.end();
  }

  private end(worker = this.worker): void {
    worker?.terminate();
    if (worker !== this.worker) return;
    this.worker = undefined;
    this.abandon = undefined;
  }

  private static spawn(): Worker {
    return new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  }
}
