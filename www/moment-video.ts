// A WebM video of pictures that come one by one, each at its own time however long it took to make.
import { type ColourCodes, type EncodedFrame, type WebmTrack, webm } from './webm.js';

const codecs = [['vp09.00.10.08', 'V_VP9'], ['vp8', 'V_VP8']] as const;
/** Frames after which one can be decoded alone, for those who seek. */
const keyInterval = 30;
/** Bits of a pixel of a frame, and between how many bits a second that is kept. */
const [bitsPerPixel, fewestBits, mostBits] = [0.5, 2_000_000, 100_000_000];
/** Frames that wait for the encoder. */
const longestQueue = 4;

/** By their names in WebCodecs: codes of ITU-T H.273. */
const matrices: Record<string, number> = { rgb: 0, bt709: 1, bt470bg: 5, smpte170m: 6, 'bt2020-ncl': 9 };
const transfers: Record<string, number> = { bt709: 1, smpte170m: 6, linear: 8, 'iec61966-2-1': 13, pq: 16, hlg: 18 };
const primaries: Record<string, number> = { bt709: 1, bt470bg: 5, smpte170m: 6, bt2020: 9, smpte432: 12 };

const missing = (message: string) => ({ code: 'NO_RECORDER', message });

function codesOf(space: VideoColorSpaceInit | undefined): ColourCodes | undefined {
  const matrix = matrices[space?.matrix ?? ''];
  const transfer = transfers[space?.transfer ?? ''];
  const primary = primaries[space?.primaries ?? ''];
  if (matrix === undefined || transfer === undefined || primary === undefined) return undefined;
  return { matrix, transfer, primaries: primary, range: space?.fullRange ? 2 : 1 };
}

export class MomentVideo {
  private readonly frames: EncodedFrame[] = [];
  private readonly encoder: VideoEncoder;
  private colour: ColourCodes | undefined;
  private failure: unknown;
  private given = 0;

  private constructor(private readonly track: WebmTrack, config: VideoEncoderConfig) {
    this.encoder = new VideoEncoder({
      output: (chunk, metadata) => {
        const bytes = new Uint8Array(chunk.byteLength);
        chunk.copyTo(bytes);
        this.frames.push({ bytes, isKey: chunk.type === 'key' });
        this.colour ??= codesOf(metadata?.decoderConfig?.colorSpace);
      },
      error: (error) => (this.failure = error),
    });
    this.encoder.configure(config);
  }

  /** A video of `rate` frames a second. Rejects with NO_RECORDER where the browser encodes none of that size. */
  static async of(width: number, height: number, rate: number): Promise<MomentVideo> {
    if (typeof VideoEncoder === 'undefined') throw missing('It has no VideoEncoder.');
    const bitrate = Math.round(Math.min(Math.max(bitsPerPixel * width * height * rate, fewestBits), mostBits));
    for (const [codec, name] of codecs) {
      const config: VideoEncoderConfig = { codec, width, height, bitrate, framerate: rate, latencyMode: 'quality' };
      const { supported } = await VideoEncoder.isConfigSupported(config).catch(() => ({ supported: false }));
      if (supported) return new MomentVideo({ codec: name, width, height, rate }, config);
    }
    throw missing(`Its VideoEncoder takes neither VP9 nor VP8 at ${width}×${height}.`);
  }

  /** Takes the next picture. */
  async add(picture: ImageData): Promise<void> {
    this.check();
    const { width, height, data } = picture;
    const microseconds = (index: number) => Math.round((1e6 * index) / this.track.rate);
    const timestamp = microseconds(this.given);
    const frame = new VideoFrame(data, { format: 'RGBA', codedWidth: width, codedHeight: height, timestamp, duration: microseconds(this.given + 1) - timestamp });
    try {
      this.encoder.encode(frame, { keyFrame: this.given % keyInterval === 0 });
    } finally {
      frame.close();
    }
    this.given += 1;
    while (this.encoder.encodeQueueSize > longestQueue) await new Promise((resolve) => setTimeout(resolve, 5));
  }

  /** Ends, and resolves to the file. Rejects with NO_RECORDER where the encoder has left something out. */
  async finish(): Promise<Blob> {
    await this.encoder.flush().catch((error: unknown) => (this.failure ??= error));
    this.check();
    this.close();
    const { frames, given, track, colour } = this;
    if (frames.length !== given) throw missing(`Its VideoEncoder wrote ${frames.length} of ${given} frames.`);
    return webm(frames, { ...track, colour });
  }

  /** Lets go of the encoder. */
  close(): void {
    if (this.encoder.state !== 'closed') this.encoder.close();
  }

  private check(): void {
    if (this.failure === undefined) return;
    throw missing(`Its VideoEncoder failed: ${(this.failure as Error).message}`);
  }
}
