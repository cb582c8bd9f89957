// Moving pictures: a video of what is shown, and an animation rendered picture by picture at exact moments.
import type { Failure } from './api.js';
import type { Compare } from './compare.js';
import { save } from './files.js';
import { byId, showError } from './notices.js';
import { Video } from './video.js';
import type { RestirViewer } from './viewer.js';

const number = (id: string) => {
  const input = byId(id, HTMLInputElement);
  return input.checkValidity() && input.value !== '' ? Number(input.value) : undefined;
};

/** What the pictures of an animation are put into. */
interface Sequence {
  ending: string;
  /** Renders the next moment, in seconds, of so many averaged frames, and puts it in. Rejects with `CANCELLED` as `renderAt`. */
  add(moment: number, samples: number, signal: AbortSignal): Promise<void>;
  finish(): Promise<Blob>;
  /** Lets go of it, finished or not. */
  close(): void;
}

// What makes files is fetched when it is used, for few visitors do.

/** Numbered PNG files called `name`. */
async function archiveOf(view: RestirViewer, name: string): Promise<Sequence> {
  const { zip } = await import('./zip.js');
  const entries: { name: string; bytes: Uint8Array<ArrayBuffer> }[] = [];
  const add = async (moment: number, samples: number, signal: AbortSignal) => {
    const png = await view.renderAt(moment, samples, { signal });
    entries.push({ name: `${name}-${String(entries.length).padStart(4, '0')}.png`, bytes: new Uint8Array(await png.arrayBuffer()) });
  };
  return { ending: 'zip', add, finish: async () => zip(entries), close: () => undefined };
}

/** A video of `rate` frames a second. */
async function videoOf(view: RestirViewer, rate: number): Promise<Sequence> {
  const { MomentVideo } = await import('./moment-video.js');
  const video = await MomentVideo.of(...view.size, rate);
  const add = async (moment: number, samples: number, signal: AbortSignal) => video.add(await view.renderAt(moment, samples, { type: 'rgba', signal }));
  return { ending: 'webm', add, finish: () => video.finish(), close: () => video.close() };
}

export class Recording {
  private readonly videoButton = byId('record-video', HTMLButtonElement);
  private readonly picturesButton = byId('record-pictures', HTMLButtonElement);
  private readonly exactButton = byId('record-exact', HTMLButtonElement);
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
    const record = (film: (rate: number) => Promise<Sequence>) => (event: Event) =>
      this.pictures ? this.pictures.abort() : void this.recordMoments(event.currentTarget as HTMLButtonElement, film);
    this.picturesButton.addEventListener('click', record(() => archiveOf(view, this.name())));
    this.exactButton.addEventListener('click', record((rate) => videoOf(view, rate)));
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

  /** Renders an animation's pictures at their moments, and saves them as one file; `button` cancels it meanwhile. */
  private async recordMoments(button: HTMLButtonElement, filmOf: (rate: number) => Promise<Sequence>): Promise<void> {
    const { view } = this;
    const [count, rate, samples] = [number('record-count'), number('record-rate'), number('record-samples')];
    if (count === undefined || rate === undefined || samples === undefined) {
      this.words.textContent = 'Frames, frames a second and averaged frames must be numbers within their ranges.';
      return;
    }
    const { scene } = view;
    if (!scene) {
      this.words.textContent = 'There is no scene yet.';
      return;
    }
    const controller = (this.pictures = new AbortController());
    const { signal } = controller;
    // A scene may take over between two pictures.
    const stop = () => controller.abort();
    view.addEventListener('load', stop);
    const others = [this.picturesButton, this.exactButton].filter((each) => each !== button);
    const label = button.textContent;
    button.textContent = 'Cancel';
    for (const other of others) other.disabled = true;
    const start = view.settings.time;
    let film: Sequence | undefined;
    try {
      // All pictures are of one size, and so is what they are put into.
      view.hold(true);
      film = await filmOf(rate);
      for (let at = 0; at < count; at++) {
        this.words.textContent = `Picture ${at + 1} of ${count}`;
        await film.add(start + at / rate, samples, signal);
      }
      save(await film.finish(), `${this.name()}.${film.ending}`);
      this.words.textContent = `${count} pictures saved.`;
    } catch (error) {
      const { code, message } = error as Partial<Failure>;
      this.words.textContent = view.scene === scene ? (message ?? '') : 'Another scene was chosen.';
      if (code !== 'CANCELLED') showError(error);
    } finally {
      view.removeEventListener('load', stop);
      view.hold(false);
      film?.close();
      this.pictures = undefined;
      button.textContent = label;
      for (const other of others) other.disabled = false;
    }
  }
}
