// Records what is drawn on a canvas as a WebM video.

const kinds = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
const bitsPerSecond = 16_000_000;
/** Milliseconds between two pieces of the file, and how long the end waits for the first one. */
const [piece, patience] = [250, 5000];

const missing = (message: string) => ({ code: 'NO_RECORDER', message });

export class Video {
  private readonly chunks: Blob[] = [];
  private readonly began = performance.now();
  /** Resolves when the encoder has written something. */
  private readonly written: Promise<void>;

  private constructor(private readonly recorder: MediaRecorder) {
    this.written = new Promise((resolve) => {
      recorder.addEventListener('dataavailable', ({ data }) => {
        if (data.size > 0) this.chunks.push(data);
        if (this.chunks.length > 0) resolve();
      });
    });
    recorder.start(piece);
  }

  /** Begins to record. Throws NO_RECORDER where the browser cannot. */
  static of(canvas: HTMLCanvasElement): Video {
    if (typeof MediaRecorder === 'undefined') throw missing('The browser has no MediaRecorder.');
    const mimeType = kinds.find((kind) => MediaRecorder.isTypeSupported(kind));
    if (!mimeType) throw missing('Its MediaRecorder writes no WebM.');
    try {
      return new Video(new MediaRecorder(canvas.captureStream(), { mimeType, videoBitsPerSecond: bitsPerSecond }));
    } catch (error) {
      throw missing((error as Error).message);
    }
  }

  /** Since it began. */
  get seconds(): number {
    return (performance.now() - this.began) / 1000;
  }

  /** Ends, and resolves to the file. Rejects with NO_RECORDER where the encoder has written nothing. */
  async stop(): Promise<Blob> {
    const { recorder } = this;
    await Promise.race([this.written, new Promise((resolve) => setTimeout(resolve, patience))]);
    const stopped = new Promise((resolve) => recorder.addEventListener('stop', resolve));
    recorder.stop();
    await stopped;
    for (const track of recorder.stream.getTracks()) track.stop();
    if (this.chunks.length === 0) throw missing('Its encoder wrote nothing.');
    return new Blob(this.chunks, { type: 'video/webm' });
  }
}
