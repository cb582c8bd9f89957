// Reads or generates one scene and builds its BVH, off the page's thread.
import init, { flatten_builtin, flatten_file } from './pkg/restir.js';
import { toFailure } from './messages.js';
import type { LoadRequest, LoadResponse, Surroundings } from './protocol.js';

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

/** The bytes of a map that was given by its address. */
async function fetched({ name, address = '' }: Surroundings): Promise<Uint8Array> {
  progress(0, `Loading ${name}`);
  let problem = 'not found';
  try {
    const response = await fetch(address);
    if (response.ok) return new Uint8Array(await response.arrayBuffer());
    problem = `the server says ${response.status} ${response.statusText}`;
  } catch (error) {
    // A server that does not let this page read its files looks like one that is not there.
    problem = `${(error as Error).message} (the server has to be there, and to allow this page to read its files)`;
  }
  throw { code: 'IO', message: `${name}: ${problem}` };
}

async function flatten({ source, surroundings, lights, seed }: LoadRequest): Promise<Uint8Array> {
  const environment = surroundings?.name;
  const map = surroundings?.address ? await fetched(surroundings) : surroundings?.bytes;
  if (source.kind === 'builtin') return flatten_builtin(source.name, lights, seed, environment, map, progress);
  const files = new Map(source.files.map(({ name, bytes }) => [baseName(name), bytes]));
  const resolve = (uri: string) => files.get(baseName(decoded(uri)));
  const main = files.get(baseName(source.name)) ?? new Uint8Array();
  return flatten_file(source.name, main, resolve, lights, seed, environment, map, progress);
}

self.onmessage = async ({ data }: MessageEvent<LoadRequest>) => {
  try {
    await init({ module_or_path: data.module });
    const flat = await flatten(data);
    reply({ kind: 'scene', flat }, [flat.buffer]);
  } catch (error) {
    reply({ kind: 'failure', failure: toFailure(error) });
  }
};
