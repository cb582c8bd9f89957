// Writes WebM files: one video track, each frame at its own time (the WebM container guidelines; RFC 8794 and 9559).
import { joined } from './bytes.js';

/** A frame as the encoder gives it. */
export interface EncodedFrame {
  bytes: Uint8Array<ArrayBuffer>;
  /** Whether it can be decoded without the ones before. */
  isKey: boolean;
}

/** What the pixels' numbers mean, as codes of ITU-T H.273. */
export interface ColourCodes {
  matrix: number;
  /** 1 for 16 to 235, 2 for 0 to 255. */
  range: number;
  transfer: number;
  primaries: number;
}

export interface WebmTrack {
  codec: 'V_VP8' | 'V_VP9';
  width: number;
  height: number;
  /** Frames a second: frame k is at k / rate. */
  rate: number;
  colour?: ColourCodes | undefined;
}

type Bytes = Uint8Array<ArrayBuffer>;

/** Most ticks between a cluster and a frame of it: a signed number of two bytes. */
const longestCluster = 0x7fff;
/** Nanoseconds of a tick at the most: players keep it in 32 bits. */
const longestTick = 1e9;

/** A number in so many bytes, the highest first; whole numbers below 2^53. */
function bigEndian(value: number, length: number): number[] {
  const bytes: number[] = [];
  for (let rest = value; bytes.length < length; rest = Math.floor(rest / 256)) bytes.unshift(rest % 256);
  return bytes;
}

function byteCount(value: number): number {
  let count = 1;
  for (let rest = Math.floor(value / 256); rest > 0; rest = Math.floor(rest / 256)) count++;
  return count;
}

/** A size as EBML writes it: the leading zeros of the first byte say how many bytes follow. */
function size(value: number): number[] {
  let length = 1;
  // All ones means unknown.
  while (value >= 2 ** (7 * length) - 1) length++;
  const bytes = bigEndian(value, length);
  bytes[0] = (bytes[0] ?? 0) | (1 << (8 - length));
  return bytes;
}

/** The beginning of an element: its id and the size of what follows. */
const begin = (id: number, length: number): Bytes => Uint8Array.from([...bigEndian(id, byteCount(id)), ...size(length)]);

/** An element of these bytes or elements. */
function element(id: number, ...parts: Bytes[]): Bytes {
  const content = joined(parts);
  return joined([begin(id, content.length), content]);
}

const whole = (id: number, value: number, length = byteCount(value)): Bytes => element(id, Uint8Array.from(bigEndian(value, length)));
const text = (id: number, words: string): Bytes => element(id, new TextEncoder().encode(words));

function real(id: number, value: number): Bytes {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, value);
  return element(id, new Uint8Array(view.buffer));
}

interface Cluster {
  /** Ticks. */
  time: number;
  blocks: Bytes[];
}

/** A cluster begins with a frame that can be decoded alone, or where the time from it no longer fits. */
function clustersOf(frames: readonly EncodedFrame[], ticks: number): Cluster[] {
  const clusters: Cluster[] = [];
  for (const [index, { bytes, isKey }] of frames.entries()) {
    const time = index * ticks;
    const open = clusters.at(-1);
    const fits = open && !isKey && time - open.time <= longestCluster;
    const cluster = fits ? open : { time, blocks: [] };
    if (!fits) clusters.push(cluster);
    // Track 1, the time from the cluster's on, whether it is a key frame.
    const head = Uint8Array.from([0x81, ...bigEndian(time - cluster.time, 2), isKey ? 0x80 : 0]);
    cluster.blocks.push(begin(0xa3, head.length + bytes.length), head, bytes);
  }
  return clusters;
}

function trackEntry({ codec, width, height, rate, colour }: WebmTrack): Bytes {
  const codes = colour && element(0x55b0, whole(0x55b1, colour.matrix), whole(0x55b9, colour.range), whole(0x55ba, colour.transfer), whole(0x55bb, colour.primaries));
  const video = element(0xe0, whole(0xb0, width), whole(0xba, height), ...(codes ? [codes] : []));
  // Number, UID, video, no lacing, nanoseconds of a frame.
  return element(0xae, whole(0xd7, 1), whole(0x73c5, 1), whole(0x83, 1), whole(0x9c, 0), whole(0x23e383, Math.round(1e9 / rate)), text(0x86, codec), video);
}

/** The file. The tick of its clock is a frame's time or a whole part of it, so that times are exact to a nanosecond a frame. */
export function webm(frames: readonly EncodedFrame[], track: WebmTrack): Blob {
  const { rate } = track;
  const ticks = Math.ceil(1e9 / rate / longestTick);
  const clusters = clustersOf(frames, ticks);
  const head = element(0x1a45dfa3, whole(0x4286, 1), whole(0x42f7, 1), whole(0x42f2, 4), whole(0x42f3, 8), text(0x4282, 'webm'), whole(0x4287, 4), whole(0x4285, 2));
  const info = element(
    0x1549a966,
    whole(0x2ad7b1, Math.round(1e9 / rate / ticks)),
    real(0x4489, frames.length * ticks),
    text(0x4d80, 'restir'),
    text(0x5741, 'restir'),
  );
  const tracks = element(0x1654ae6b, trackEntry(track));
  // Places count from the first byte of the segment's contents; all of one length, so that the list of them has its size before they are known.
  const seek = (id: number, place: number) => element(0x4dbb, element(0x53ab, Uint8Array.from(bigEndian(id, 4))), whole(0x53ac, place, 8));
  const seekHead = (places: [number, number, number]) => {
    const [infoAt, tracksAt, cuesAt] = places;
    return element(0x114d9b74, seek(0x1549a966, infoAt), seek(0x1654ae6b, tracksAt), seek(0x1c53bb6b, cuesAt));
  };
  const infoAt = seekHead([0, 0, 0]).length;
  const tracksAt = infoAt + info.length;
  let place = tracksAt + tracks.length;
  const parts: BlobPart[] = [];
  const cuePoints: Bytes[] = [];
  for (const { time, blocks } of clusters) {
    const clock = whole(0xe7, time);
    const length = blocks.reduce((sum, block) => sum + block.length, clock.length);
    const opening = begin(0x1f43b675, length);
    cuePoints.push(element(0xbb, whole(0xb3, time), element(0xb7, whole(0xf7, 1), whole(0xf1, place))));
    parts.push(opening, clock, ...blocks);
    place += opening.length + length;
  }
  const cues = element(0x1c53bb6b, ...cuePoints);
  const contents = [seekHead([infoAt, tracksAt, place]), info, tracks];
  return new Blob([head, begin(0x18538067, place + cues.length), ...contents, ...parts, cues], { type: 'video/webm' });
}
