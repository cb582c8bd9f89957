// Loads a scene in a worker of its own. The worker ends with the load, and its memory with it.
import type { LoadRequest, LoadResponse } from './protocol.js';

export type Progress = (fraction: number, what: string) => void;

export class SceneLoader {
  private worker: Worker | undefined = SceneLoader.spawn();
  private busy = false;

  /** Resolves to the flat scene's bytes, or rejects with a `Failure`. A load still running is abandoned and never settles. */
  async load(request: Promise<WebAssembly.Module>, rest: Omit<LoadRequest, 'module'>, progress: Progress): Promise<Uint8Array> {
    // The first worker starts with the page, so that its scripts load while the wasm module compiles.
    if (this.busy) this.end();
    const worker = (this.worker ??= SceneLoader.spawn());
    this.busy = true;
    const module = await request;
    return new Promise((resolve, reject) => {
      worker.onmessage = ({ data }: MessageEvent<LoadResponse>) => {
        if (data.kind === 'progress') return progress(data.fraction, data.what);
        this.end(worker);
        if (data.kind === 'scene') resolve(data.flat);
        else reject(data.failure);
      };
      worker.onerror = (event) => {
        this.end(worker);
        reject({ code: 'WORKER', message: event.message || 'the scene could not be read: out of memory, or the page is incomplete' });
      };
      worker.postMessage({ module, ...rest } satisfies LoadRequest);
    });
  }

  private end(worker = this.worker): void {
    worker?.terminate();
    if (worker !== this.worker) return;
    this.worker = undefined;
    this.busy = false;
  }

  private static spawn(): Worker {
    return new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  }
}
