// Reads or generates one scene and builds its BVH, off the page's thread.
import { type Received, decoded, fetchBytes, fetchScene } from './fetch-scene.js';
import type { Progress } from './loader.js';
import init, { flatten_builtin } from './pkg/restir.js';
import { toFailure } from './messages.js';
import type { Contents, LoadRequest, LoadResponse, Loaded, SceneSource, Surroundings } from './protocol.js';
import { type Stage, sizeText } from './stages.js';

const reply = (response: LoadResponse, transfer: Transferable[] = []) => self.postMessage(response, { transfer });

const progress: Progress = (stage, fraction, what) => reply({ kind: 'progress', stage, fraction, what });

/** The part of a load that its download is, where there is one. */
let downloaded = 0;

/** What the modules tell while they read and build. */
const building = (stage: Stage, fraction: number, what: string) => progress(stage, downloaded + (1 - downloaded) * fraction, what);

/** Milliseconds between two reports of a download. */
const interval = 50;

/** Tells how much of the files called `name` has come. */
function downloading(name: string): Received {
  let [come, announced, told] = [0, 0, -Infinity];
  downloaded = 0.5;
  progress('download', 0, `Loading ${name}`);
  return (bytes, more) => {
    come += bytes;
    announced += more;
    if (performance.now() - told < interval) return;
    told = performance.now();
    // A server that announces too little, or nothing, is not believed.
    const known = announced >= come && announced > 0;
    progress('download', known ? (downloaded * come) / announced : 0, `Loading ${name}: ${sizeText(come)}${known ? ` of ${sizeText(announced)}` : ''}`);
  };
}

/** The last part of a path or URI: files picked or dropped come without their folders. */
const baseName = (uri: string) => uri.slice(uri.lastIndexOf('/') + 1);

/** What reads files is a module of its own: who looks at built-in scenes does not download it. */
async function startLoader() {
  progress('parse', downloaded, 'Fetching the loader');
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
  if (source.kind === 'address') return fetchScene(source.name, source.address, downloading(source.name));
  progress('download', 0, 'Reading');
  return new Map(await Promise.all(source.files.map(read)));
}

async function flattenFile(source: FileSource, lighting: Lighting): Promise<Loaded> {
  const { name, choice } = source;
  const files = await gather(source);
  const resolve = (uri: string) => files.get(uri) ?? files.get(decoded(uri)) ?? files.get(baseName(decoded(uri)));
  const main = resolve(name) ?? new Uint8Array();
  const { contents_of, flatten_file, uncook } = await startLoader();
  progress('parse', downloaded, `Reading ${name}`);
  if (/\.restir$/i.test(name)) {
    if (lighting.environment !== undefined) throw { code: 'UNSUPPORTED', message: `${name} is cooked and keeps its own environment.` };
    return { flat: uncook(name, main) };
  }
  const flat = flatten_file(name, main, resolve, choice, lighting, building);
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
  return fetchBytes(surroundings.name, surroundings.address, downloading(surroundings.name));
}

async function load({ module, source, surroundings, lights, seed }: LoadRequest): Promise<Loaded> {
  const lighting: Lighting = { lights, seed, environment: surroundings?.name, map: await mapOf(surroundings) };
  if (source.kind !== 'builtin') return flattenFile(source, lighting);
  if (lighting.map) return { flat: (await startLoader()).flatten_builtin(source.name, lighting, building) };
  await init({ module_or_path: module });
  progress('parse', 0, 'Making the scene');
  return { flat: flatten_builtin(source.name, lighting, building) };
}

self.onmessage = async ({ data }: MessageEvent<LoadRequest>) => {
  try {
    const loaded = await load(data);
    reply({ kind: 'scene', ...loaded }, [loaded.flat.buffer]);
  } catch (error) {
    reply({ kind: 'failure', failure: toFailure(error) });
  }
};
