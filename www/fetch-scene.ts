// A scene file by its address, and the files that it names, which lie beside it.
import { joined } from './bytes.js';

/** Told of bytes that have come, and of bytes that will come besides. */
export type Received = (bytes: number, announced: number) => void;

/** What a response holds, told piece by piece. */
async function bytesOf(response: Response, received: Received): Promise<Uint8Array> {
  if (!response.body) return new Uint8Array(await response.arrayBuffer());
  // What is compressed on its way announces the bytes of the way.
  const announced = response.headers.has('content-encoding') ? 0 : Number(response.headers.get('content-length') ?? 0);
  received(0, announced);
  const pieces: Uint8Array[] = [];
  const reader = response.body.getReader();
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    if (!value) continue;
    pieces.push(value);
    received(value.length, 0);
  }
  return joined(pieces);
}

/** The bytes at `address`; throws IO, with `name` and the reason. */
export async function fetchBytes(name: string, address: string, received: Received): Promise<Uint8Array> {
  let problem: string;
  try {
    const response = await fetch(address);
    if (response.ok) return await bytesOf(response, received);
    problem = `the server says ${response.status} ${response.statusText}`;
  } catch (error) {
    // A server that does not let this page read its files looks like one that is not there.
    problem = `${(error as Error).message} (the server has to be there, and to allow this page to read its files)`;
  }
  throw { code: 'IO', message: `${name}: ${problem}` };
}

/** `%20` and the like as what they stand for. */
export function decoded(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

/** URIs of the buffers and images that are not in the file itself. What is broken is the reader's to say. */
function namedByGltf(json: string): string[] {
  try {
    const { buffers = [], images = [] } = JSON.parse(json) as Record<string, { uri?: string }[]>;
    return [...buffers, ...images].flatMap(({ uri }) => (uri === undefined || uri.startsWith('data:') ? [] : [uri]));
  } catch {
    return [];
  }
}

/** What follows the keyword on each line where `keyword` matches. */
const wordsAfter = (keyword: string, text: string) => [...text.matchAll(new RegExp(`^\\s*(?:${keyword})\\s+(.*\\S)`, 'gim'))].map((match) => match[1] ?? '');

/** The files that `name` refers to, as it writes them. */
function namedBy(name: string, bytes: Uint8Array): string[] {
  const text = (from = 0, to?: number) => new TextDecoder().decode(bytes.subarray(from, to));
  if (/\.gltf$/i.test(name)) return namedByGltf(text());
  // A header of 12 bytes, the length of the JSON, its kind, the JSON.
  if (/\.glb$/i.test(name) && bytes.length > 20) return namedByGltf(text(20, 20 + new DataView(bytes.buffer, bytes.byteOffset).getUint32(12, true)));
  if (/\.obj$/i.test(name)) return wordsAfter('mtllib', text());
  // Options stand before the name of a map.
  if (/\.mtl$/i.test(name)) return wordsAfter('map_\\w+|bump|norm|disp|decal|refl', text()).map((words) => words.split(/\s+/).at(-1) ?? '');
  return [];
}

/** The file at `address` under `name`, and all that it names under the names that it uses. Throws IO. */
export async function fetchScene(name: string, address: string, received: Received): Promise<Map<string, Uint8Array>> {
  const files = new Map<string, Uint8Array>();
  const take = async (uri: string, url: string): Promise<void> => {
    if (files.has(decoded(uri))) return;
    const others = files.size > 0;
    files.set(decoded(uri), new Uint8Array());
    let bytes: Uint8Array;
    try {
      bytes = await fetchBytes(uri, url, received);
    } catch (error) {
      // What is missing beside an OBJ is a warning, or not needed: its reader says so.
      if (!others || !/\.obj$/i.test(name)) throw error;
      files.delete(decoded(uri));
      return;
    }
    files.set(decoded(uri), bytes);
    await Promise.all(namedBy(uri, bytes).map((other) => take(other, new URL(other, address).href)));
  };
  await take(name, address);
  return files;
}
