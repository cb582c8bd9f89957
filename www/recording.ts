// Moving pictures: a video of what is shown, and the pictures of an animation one by one.
import type { Compare } from './compare.js';
import { save } from './files.js';
import { byId, showError } from './notices.js';
import { Video } from './video.js';
import type { RestirViewer } from './viewer.js';
import { type ZipEntry, zip } from './zip.js';

const number = (id: string) => {
  const input = byId(id, HTMLInputElement);
  return input.checkValidity() && input.value !== '' ? Number(input.value) : undefined;
};

export class Recording {
  private readonly videoButton = byId('record-video', HTMLButtonElement);
  private readonly picturesButton = byId('record-pictures', HTMLButtonElement);
  private readonly words = byId('record-words', HTMLElement);
  private stopVideo: (() => void) | undefined;
  private pictures: AbortController | undefined;

  constructor(
    private readonly view: RestirViewer,
    private readonly compare: Compare,
    /** What files are called, without an ending. */
    private readonly name: () => string,
  ) {
    this.videoButton.addEventListener('click', () => (this.stopVideo ? this.stopVideo() : void this.recordVideo()));
    this.picturesButton.addEventListener('click', () => (this.pictures ? this.pictures.abort() : void this.recordPictures()));
  }

  /** Draws each finished frame on a canvas of its own, as large as the picture is now, until it is stopped. */
  private async recordVideo(): Promise<void> {
    const { view } = this;
    const canvas = document.createElement('canvas');
    const context = canvas.getContext('2d');
    if (!context || !view.scene) return;
    [canvas.width, canvas.height] = view.size;
    const paint = () => view.drawOn(context).then(() => this.compare.drawOn(context)).catch(() => undefined);
    // A recorder begins with what the canvas has: that shall be a picture. A second press meanwhile is none.
    this.videoButton.disabled = true;
    await paint();
    this.videoButton.disabled = false;
    let video: Video;
    try {
      video = Video.of(canvas);
    } catch (error) {
      return showError(error);
    }
    let drawing = false;
    const draw = async () => {
      // Frames that come faster than they are drawn are left out.
      if (drawing) return;
      drawing = true;
      await paint();
      drawing = false;
      if (this.stopVideo) this.videoButton.textContent = `Stop, ${video.seconds.toFixed(0)} s`;
    };
    const clock = setInterval(() => void draw(), 500);
    view.addEventListener('sample', draw);
    this.videoButton.setAttribute('aria-pressed', 'true');
    const stop = async () => {
      this.videoButton.disabled = true;
      await video.stop().then((file) => save(file, `${this.name()}.webm`), showError);
      clearInterval(clock);
      view.removeEventListener('sample', draw);
      this.stopVideo = undefined;
      this.videoButton.disabled = false;
      this.videoButton.setAttribute('aria-pressed', 'false');
      this.videoButton.textContent = 'Record video';
    };
    this.stopVideo = () => void stop();
    await draw();
  }

  /** Renders an animation's pictures at their moments, and saves them as one archive. */
  private async recordPictures(): Promise<void> {
    const { view } = this;
    const [count, rate, samples] = [number('record-count'), number('record-rate'), number('record-samples')];
    if (count === undefined || rate === undefined || samples === undefined) {
      this.words.textContent = 'Frames, frames a second and averaged frames must be numbers within their ranges.';
      return;
    }
    const { signal } = (this.pictures = new AbortController());
    this.picturesButton.textContent = 'Cancel';
    const start = view.settings.time;
    const entries: ZipEntry[] = [];
    const { scene } = view;
    const { size } = view.settings;
    try {
      // All pictures are of one size.
      await view.setSize(view.size);
      for (let at = 0; at < count && !signal.aborted; at++) {
        if (view.scene !== scene || view.loading) throw { code: 'CANCELLED', message: 'Another scene was chosen: no pictures were saved.' };
        this.words.textContent = `Picture ${at + 1} of ${count}`;
        const png = await view.renderAt(start + at / rate, samples);
        entries.push({ name: `${this.name()}-${String(at).padStart(4, '0')}.png`, bytes: new Uint8Array(await png.arrayBuffer()) });
      }
      if (!signal.aborted) save(zip(entries), `${this.name()}.zip`);
      this.words.textContent = signal.aborted ? 'Cancelled.' : `${count} pictures saved.`;
    } catch (error) {
      this.words.textContent = '';
      showError(error);
    } finally {
      this.pictures = undefined;
      this.picturesButton.textContent = 'Save pictures';
      await view.setSize(size).catch(() => undefined);
      // Back to the moment that was shown, unless something else was asked for.
      if (view.scene === scene && !view.loading) await view.show(view.settings, view.scene).catch(() => undefined);
    }
  }
}
