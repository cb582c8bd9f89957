// Reads or generates one scene and builds its BVH, off the page's thread.
import init, { contents_of, flatten_builtin, flatten_file, uncook } from './pkg/restir.js';
import { toFailure } from './messages.js';
import type { Contents, LoadRequest, LoadResponse, Loaded, SceneSource, Surroundings } from './protocol.js';

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

/** What a decoder threw, with the name of the file. */
function named(name: string, thrown: unknown) {
  const { code, message } = toFailure(thrown);
  if (message.startsWith(name)) return { code, message };
  return { code, message: `${name}: ${message}${code === 'UNSUPPORTED' ? ' is not supported' : ''}` };
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

/** Decoders that only some files need are a module of their own. */
async function fetchDecoders() {
  progress(0, 'Fetching decoders');
  const decoders = await import('./pkg/decoders.js');
  await decoders.default();
  return decoders;
}

async function read(file: File): Promise<[string, Uint8Array]> {
  try {
    return [baseName(file.name), new Uint8Array(await file.arrayBuffer())];
  } catch (error) {
    throw { code: 'IO', message: `${file.name}: ${(error as Error).message}` };
  }
}

/** Name of what surrounds the scene, and the map that it is as the decoders give it. */
type Around = [environment: string | undefined, map: Uint8Array | undefined];

async function flattenFile({ name, files, choice }: SceneSource & { kind: 'file' }, lights: number, seed: number, around: Around): Promise<Loaded> {
  progress(0, 'Reading');
  const beside = new Map(await Promise.all(files.map(read)));
  const resolve = (uri: string) => beside.get(baseName(decoded(uri)));
  const main = beside.get(baseName(name)) ?? new Uint8Array();
  const flatten = (bytes: Uint8Array, decoders: object | undefined, warnings: string[]) =>
    flatten_file(name, bytes, resolve, { ...choice, decoders, warnings }, lights, seed, ...around, progress);

  if (/\.restir$/i.test(name)) {
    if (around[0] !== undefined) throw { code: 'UNSUPPORTED', message: `${name} is cooked and keeps its own environment.` };
    return { flat: uncook(name, main) };
  }
  if (/\.obj$/i.test(name)) {
    const decoders = await fetchDecoders();
    try {
      const { glb, warnings } = decoders.convert_obj(main, resolve) as { glb: Uint8Array; warnings: string[] };
      return { flat: flatten(glb, decoders, warnings) };
    } catch (error) {
      throw named(name, error);
    }
  }
  const contents = JSON.parse(contents_of(name, main)) as Contents & { needs_decoders: boolean };
  const decoders = contents.needs_decoders ? await fetchDecoders() : undefined;
  return { flat: flatten(main, decoders, []), contents };
}

async function readAround(surroundings: Surroundings | undefined): Promise<Around> {
  const file = surroundings?.address ? await fetched(surroundings) : surroundings?.bytes;
  if (!surroundings || !file) return [surroundings?.name, undefined];
  const decoders = await fetchDecoders();
  try {
    return [surroundings.name, decoders.decode_map(file)];
  } catch (error) {
    throw named(surroundings.name, error);
  }
}

async function load({ source, surroundings, lights, seed }: LoadRequest): Promise<Loaded> {
  const around = await readAround(surroundings);
  if (source.kind === 'builtin') return { flat: flatten_builtin(source.name, lights, seed, ...around, progress) };
  return flattenFile(source, lights, seed, around);
}

self.onmessage = async ({ data }: MessageEvent<LoadRequest>) => {
  try {
    await init({ module_or_path: data.module });
    const loaded = await load(data);
    reply({ kind: 'scene', ...loaded }, [loaded.flat.buffer]);
  } catch (error) {
    reply({ kind: 'failure', failure: toFailure(error) });
  }
};
