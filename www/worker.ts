// Reads or generates one scene and builds its BVH, off the page's thread.
import init, { flatten_builtin, flatten_file } from './pkg/restir.js';
import { toFailure } from './messages.js';
import type { LoadRequest, LoadResponse } from './protocol.js';

const reply = (response: LoadResponse, transfer: Transferable[] = []) => self.postMessage(response, { transfer });

const progress = (fraction: number, what: string) => reply({ kind: 'progress', fraction, what });

/** The last part of a path or URI: files picked or dropped come without their folders. */
const baseName = (uri: string) => uri.slice(uri.lastIndexOf('/') + 1);

function decoded(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

function flatten({ source, lights, seed }: LoadRequest): Uint8Array {
  if (source.kind === 'builtin') return flatten_builtin(source.name, lights, seed, progress);
  const files = new Map(source.files.map(({ name, bytes }) => [baseName(name), bytes]));
  const resolve = (uri: string) => files.get(baseName(decoded(uri)));
  const main = files.get(baseName(source.name)) ?? new Uint8Array();
  return flatten_file(source.name, main, resolve, lights, seed, progress);
}

self.onmessage = async ({ data }: MessageEvent<LoadRequest>) => {
  try {
    await init({ module_or_path: data.module });
    const flat = flatten(data);
    reply({ kind: 'scene', flat }, [flat.buffer]);
  } catch (error) {
    reply({ kind: 'failure', failure: toFailure(error) });
  }
};
