// Writes OpenEXR files as `restir render` does (src/output/exr.rs): 32-bit float scanlines, ZIP compression by the browser's own deflate.
import { joined } from './bytes.js';

/** A picture with what its pixels see first. Rows from the top. */
export interface ExrPicture {
  width: number;
  height: number;
  /** Linear Rec. 709, three numbers a pixel: channels `R`, `G`, `B`. */
  pixels: Float32Array;
  /** Four numbers a pixel: linear albedo, and depth in metres. */
  albedoDepth: Float32Array;
  /** Four numbers a pixel, of which the first three are the normal in world space. */
  normal: Float32Array;
  /** Four numbers a pixel, of which the first two are the motion in pixels. */
  motion: Float32Array;
  /** Attributes of the file, as text. */
  attributes: Record<string, string>;
}

/** Where a channel is: in which array, and which of how many numbers of a pixel. */
type Channel = [name: string, array: 'pixels' | 'albedoDepth' | 'normal' | 'motion', at: number, of: number];

/** In the order of their names, as the format wants. */
const channels: Channel[] = [
  ['B', 'pixels', 2, 3],
  ['G', 'pixels', 1, 3],
  ['R', 'pixels', 0, 3],
  ['albedo.B', 'albedoDepth', 2, 4],
  ['albedo.G', 'albedoDepth', 1, 4],
  ['albedo.R', 'albedoDepth', 0, 4],
  ['depth.Z', 'albedoDepth', 3, 4],
  ['motion.X', 'motion', 0, 4],
  ['motion.Y', 'motion', 1, 4],
  ['normal.X', 'normal', 0, 4],
  ['normal.Y', 'normal', 1, 4],
  ['normal.Z', 'normal', 2, 4],
];

/** Rows of a chunk of ZIP compression, and its number; the number of 32-bit float. */
const [chunkRows, zip, float] = [16, 3, 2];
/** x and y of red, green, blue and white. */
const rec709 = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

type Bytes = Uint8Array<ArrayBuffer>;

const text = (words: string): Bytes => new TextEncoder().encode(words);
/** Ended by a zero, as names are. */
const named = (words: string): Bytes => text(`${words}\0`);

/** Numbers of four bytes, little-endian. */
function numbers(kind: 'Int32' | 'Float32', ...values: number[]): Bytes {
  const view = new DataView(new ArrayBuffer(4 * values.length));
  for (const [index, value] of values.entries()) view[`set${kind}`](4 * index, value, true);
  return new Uint8Array(view.buffer);
}

const attribute = (name: string, type: string, value: Bytes): Bytes => joined([named(name), named(type), numbers('Int32', value.length), value]);

function header({ width, height, attributes }: ExrPicture): Bytes {
  // Not linear in perception, three reserved bytes, no subsampling.
  const list = joined([...channels.map(([name]) => joined([named(name), numbers('Int32', float, 0, 1, 1)])), Uint8Array.of(0)]);
  const window = numbers('Int32', 0, 0, width - 1, height - 1);
  return joined([
    // The magic number, and version 2 without flags.
    numbers('Int32', 20000630, 2),
    attribute('channels', 'chlist', list),
    attribute('chromaticities', 'chromaticities', numbers('Float32', ...rec709)),
    attribute('chunkCount', 'int', numbers('Int32', Math.ceil(height / chunkRows))),
    attribute('compression', 'compression', Uint8Array.of(zip)),
    attribute('dataWindow', 'box2i', window),
    attribute('displayWindow', 'box2i', window),
    attribute('lineOrder', 'lineOrder', Uint8Array.of(0)),
    attribute('pixelAspectRatio', 'float', numbers('Float32', 1)),
    attribute('screenWindowCenter', 'v2f', numbers('Float32', 0, 0)),
    attribute('screenWindowWidth', 'float', numbers('Float32', 1)),
    attribute('type', 'string', text('scanlineimage')),
    ...Object.entries(attributes).map(([name, value]) => attribute(name, 'string', text(value))),
    Uint8Array.of(0),
  ]);
}

/** Rows from `first` on: of each row one channel after another. */
function rows(picture: ExrPicture, first: number): Bytes {
  const { width, height } = picture;
  const count = Math.min(chunkRows, height - first);
  // Little-endian, as every machine is that has WebGPU.
  const values = new Float32Array(count * channels.length * width);
  let to = 0;
  for (let row = first; row < first + count; row++) {
    for (const [, array, at, of] of channels) {
      const numbers = picture[array];
      let from = row * width * of + at;
      for (let x = 0; x < width; x++, from += of) values[to++] = numbers[from] ?? 0;
    }
  }
  return new Uint8Array(values.buffer);
}

async function deflated(bytes: Bytes): Promise<Bytes> {
  // What browsers call deflate is the format of zlib, which is meant here.
  const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Compresses a chunk: first bytes of pairs before second ones, each as its difference from the one before, deflated. What does not shrink stays as it is. */
async function compressed(bytes: Bytes): Promise<Bytes> {
  const apart = new Uint8Array(bytes.length);
  const half = Math.ceil(bytes.length / 2);
  for (let at = 0; at < bytes.length; at++) apart[(at >> 1) + (at & 1 ? half : 0)] = bytes[at] ?? 0;
  for (let at = apart.length - 1; at > 0; at--) apart[at] = (apart[at] ?? 0) - (apart[at - 1] ?? 0) + 128;
  const small = await deflated(apart);
  return small.length < bytes.length ? small : bytes;
}

/** The file. */
export async function encodeExr(picture: ExrPicture): Promise<Blob> {
  const head = header(picture);
  const count = Math.ceil(picture.height / chunkRows);
  const table = new BigUint64Array(count);
  const chunks: Bytes[] = [];
  let offset = head.length + table.byteLength;
  for (let index = 0; index < count; index++) {
    const first = index * chunkRows;
    const data = await compressed(rows(picture, first));
    const chunk = joined([numbers('Int32', first, data.length), data]);
    table[index] = BigInt(offset);
    offset += chunk.length;
    chunks.push(chunk);
  }
  return new Blob([head, table, ...chunks], { type: 'image/x-exr' });
}
