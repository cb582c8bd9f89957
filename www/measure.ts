// How far one picture is from another, worked out in a worker that all viewers of a page share.
import type { Errors, Failure } from './api.js';
import { compileWasm } from './wasm.js';

/** Linear Rec. 709 radiance, or what a debug view shows: three numbers a pixel, row-major from the top. */
export interface Picture {
  /** `radiance`, or the name of the view. */
  view: string;
  /** Moment of the scene, in seconds. */
  time: number;
  width: number;
  height: number;
  pixels: Float32Array;
}

export interface MeasureRequest {
  id: number;
  module: WebAssembly.Module;
  kind: 'errors' | 'flip';
  picture: Float32Array;
  reference: Float32Array;
  width: number;
}

export interface MeasureReply {
  id: number;
  result?: unknown;
  failure?: Failure;
}

let worker: Worker | undefined;
let count = 0;
const waiting = new Map<number, { resolve: (result: unknown) => void; reject: (failure: Failure) => void }>();

function start(): Worker {
  const made = new Worker(new URL('./measure-worker.js', import.meta.url), { type: 'module' });
  made.onmessage = ({ data: { id, result, failure } }: MessageEvent<MeasureReply>) => {
    const asked = waiting.get(id);
    waiting.delete(id);
    if (failure) asked?.reject(failure);
    else asked?.resolve(result);
  };
  const fail = (event: Event) => {
    made.terminate();
    worker = undefined;
    const message = (event instanceof ErrorEvent && event.message) || 'pictures could not be compared';
    for (const { reject } of waiting.values()) reject({ code: 'WORKER', message });
    waiting.clear();
  };
  made.onerror = fail;
  made.onmessageerror = fail;
  return made;
}

async function ask(kind: MeasureRequest['kind'], picture: Picture, reference: Picture): Promise<unknown> {
  if (picture.width !== reference.width || picture.height !== reference.height) {
    const size = ({ width, height }: Picture) => `${width}x${height}`;
    throw { code: 'BAD_VALUE', message: `a picture of ${size(picture)} is not compared with one of ${size(reference)}` };
  }
  if (picture.view !== reference.view) {
    throw { code: 'BAD_VALUE', message: `a picture of ${picture.view} is not compared with one of ${reference.view}` };
  }
  const module = await compileWasm();
  worker ??= start();
  const id = ++count;
  const { pixels, width } = picture;
  const request: MeasureRequest = { id, module, kind, picture: pixels, reference: reference.pixels, width };
  return new Promise((resolve, reject) => {
    waiting.set(id, { resolve, reject });
    worker?.postMessage(request);
  });
}

/** Distances of a picture from a reference. Rejects with `BAD_VALUE` where they are of different sizes or views. */
export const errorsOf = (picture: Picture, reference: Picture) => ask('errors', picture, reference) as Promise<Errors>;

/** FLIP of each pixel, 0 to 1: what an observer perceives when the two are shown in turn (Andersson et al. 2020). Rejects as `errorsOf`. */
export const flipOf = (picture: Picture, reference: Picture) => ask('flip', picture, reference) as Promise<Float32Array>;
