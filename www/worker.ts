// Reads or generates one scene and builds its BVH, off the page's thread.
import { decoded, fetchBytes, fetchScene } from './fetch-scene.js';
import init, { flatten_builtin } from './pkg/restir.js';
import { toFailure } from './messages.js';
import type { Contents, LoadRequest, LoadResponse, Loaded, SceneSource, Surroundings } from './protocol.js';

const reply = (response: LoadResponse, transfer: Transferable[] = []) => self.postMessage(response, { transfer });

const progress = (fraction: number, what: string) => reply({ kind: 'progress', fraction, what });

/** The last part of a path or URI: files picked or dropped come without their folders. */
const baseName = (uri: string) => uri.slice(uri.lastIndexOf('/') + 1);

/** What reads files is a module of its own: who looks at built-in scenes does not download it. */
async function startLoader() {
  progress(0, 'Fetching the loader');
  const loader = await import('./pkg/loader.js');
  await loader.default();
  return loader;
}

async function read(file: File): Promise<[string, Uint8Array]> {
  try {
    return [baseName(file.name), new Uint8Array(await file.arrayBuffer())];
  } catch (error) {
    throw { code: 'IO', message: `${file.name}: ${(error as Error).message}` };
  }
}

type FileSource = Exclude<SceneSource, { kind: 'builtin' }>;

/** The scene file and those beside it, by name. */
async function gather(source: FileSource): Promise<Map<string, Uint8Array>> {
  progress(0, source.kind === 'file' ? 'Reading' : `Loading ${source.name}`);
  return source.kind === 'file' ? new Map(await Promise.all(source.files.map(read))) : fetchScene(source.name, source.address);
}

async function flattenFile(source: FileSource, lighting: Lighting): Promise<Loaded> {
  const { name, choice } = source;
  const files = await gather(source);
  const resolve = (uri: string) => files.get(uri) ?? files.get(decoded(uri)) ?? files.get(baseName(decoded(uri)));
  const main = resolve(name) ?? new Uint8Array();
  const { contents_of, flatten_file, uncook } = await startLoader();
  if (/\.restir$/i.test(name)) {
    if (lighting.environment !== undefined) throw { code: 'UNSUPPORTED', message: `${name} is cooked and keeps its own environment.` };
    return { flat: uncook(name, main) };
  }
  const flat = flatten_file(name, main, resolve, choice, lighting, progress);
  return /\.obj$/i.test(name) ? { flat } : { flat, contents: JSON.parse(contents_of(name, main)) as Contents };
}

/** What the modules are told of a scene's light. */
interface Lighting {
  lights: number;
  seed: number;
  environment: string | undefined;
  map: Uint8Array | undefined;
}

async function mapOf(surroundings: Surroundings | undefined): Promise<Uint8Array | undefined> {
  if (!surroundings?.address) return surroundings?.bytes;
  progress(0, `Loading ${surroundings.name}`);
  return fetchBytes(surroundings.name, surroundings.address);
}

async function load({ module, source, surroundings, lights, seed }: LoadRequest): Promise<Loaded> {
  const lighting: Lighting = { lights, seed, environment: surroundings?.name, map: await mapOf(surroundings) };
  if (source.kind !== 'builtin') return flattenFile(source, lighting);
  if (lighting.map) return { flat: (await startLoader()).flatten_builtin(source.name, lighting, progress) };
  await init({ module_or_path: module });
  return { flat: flatten_builtin(source.name, lighting, progress) };
}

self.onmessage = async ({ data }: MessageEvent<LoadRequest>) => {
  try {
    const loaded = await load(data);
    reply({ kind: 'scene', ...loaded }, [loaded.flat.buffer]);
  } catch (error) {
    reply({ kind: 'failure', failure: toFailure(error) });
  }
};
