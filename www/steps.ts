// One frame, pass by pass: what each wrote, its equations, its source.
import type { DissectedPass } from './api.js';
import { equationsOf } from './equations.js';
import { byId } from './notices.js';
import type { RestirViewer } from './viewer.js';

/** Text of files under shaders/, by path. */
const sources = new Map<string, Promise<string>>();

function sourceOf(file: string): Promise<string> {
  const read = async () => {
    const response = await fetch(new URL(`./shaders/${file}`, import.meta.url));
    if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
    return response.text();
  };
  const text = sources.get(file) ?? read();
  sources.set(file, text);
  // What failed is tried again.
  text.catch(() => sources.delete(file));
  return text;
}

export class Steps {
  private passes: DissectedPass[] = [];
  /** Counts what was begun and ended: a frame that is taken apart meanwhile is of no use any more. */
  private turn = 0;
  /** Whether a frame is about to be taken apart. */
  private waits = false;
  private at = 0;
  /** Which of its files is shown: the pass's own, or one that it includes. */
  private file = '';
  private readonly panel = byId('steps', HTMLElement);
  private readonly button = byId('dissect', HTMLButtonElement);
  private readonly list = byId('steps-passes', HTMLOListElement);
  private readonly picture = byId('passed', HTMLCanvasElement);

  constructor(
    private readonly view: RestirViewer,
    /** Told before it opens: the picture is to stop, so that the frame stays, and there is room for one panel. */
    private readonly opening: () => void,
  ) {
    this.button.addEventListener('click', () => (this.panel.hidden ? void this.begin() : this.end()));
    byId('steps-close', HTMLButtonElement).addEventListener('click', () => this.end());
    byId('steps-frame', HTMLButtonElement).addEventListener('click', () => void this.begin());
    byId('steps-back', HTMLButtonElement).addEventListener('click', () => this.go(this.at - 1));
    byId('steps-on', HTMLButtonElement).addEventListener('click', () => this.go(this.at + 1));
    // A picture of something else is no frame of these passes, nor does one lie over frames that go on, as after a change of size. But
    // what is still to be taken apart is the frame of what has changed.
    for (const event of ['load', 'camera-change', 'param-change', 'restored', 'sample'] as const) {
      view.addEventListener(event, () => !this.panel.hidden && !this.waits && this.end());
    }
  }

  /** Renders the next frame and takes it apart. */
  private async begin(): Promise<void> {
    this.opening();
    const turn = ++this.turn;
    this.waits = true;
    const passes = await this.view.dissect().catch(() => undefined);
    this.waits = false;
    if (!passes || turn !== this.turn) return;
    this.passes = passes;
    this.panel.hidden = false;
    this.button.setAttribute('aria-pressed', 'true');
    const items = passes.map(({ id, picture }, index) => {
      const button = Object.assign(document.createElement('button'), { type: 'button', textContent: id });
      button.classList.toggle('bare', !picture);
      button.addEventListener('click', () => this.go(index));
      const item = document.createElement('li');
      item.append(button);
      return item;
    });
    this.list.replaceChildren(...items);
    this.go(0);
  }

  /** Closes the panel, if it is open. */
  end(): void {
    this.turn += 1;
    if (this.panel.hidden) return;
    this.panel.hidden = this.picture.hidden = true;
    this.button.setAttribute('aria-pressed', 'false');
    this.passes = [];
  }

  private go(to: number): void {
    const pass = this.passes[to];
    if (!pass) return;
    this.at = to;
    for (const [index, button] of [...this.list.querySelectorAll('button')].entries()) {
      if (index === to) button.setAttribute('aria-current', 'step');
      else button.removeAttribute('aria-current');
    }
    byId('steps-back', HTMLButtonElement).disabled = to === 0;
    byId('steps-on', HTMLButtonElement).disabled = to === this.passes.length - 1;
    // Of a pass that wrote no picture the one before stays.
    const shown = this.passes.slice(0, to + 1).map(({ picture }) => picture).filter((picture) => picture !== undefined).at(-1);
    this.picture.hidden = !shown;
    if (shown) {
      [this.picture.width, this.picture.height] = [shown.width, shown.height];
      this.picture.getContext('2d')?.putImageData(shown, 0, 0);
    }
    const words = pass.picture ? 'What it wrote, or what that makes when it is shaded' : 'It wrote no picture; the one before stays';
    byId('steps-words', HTMLElement).textContent = `Pass ${to + 1} of ${this.passes.length}, ${pass.id}. ${words}.`;
    const equations = equationsOf(pass.id);
    byId('steps-equations', HTMLElement).replaceChildren(...(equations ? [equations] : []));
    void this.showSource(pass.file);
  }

  private async showSource(file: string): Promise<void> {
    this.file = file;
    const text = await sourceOf(file).catch((error: unknown) => `${file} could not be read: ${(error as Error).message}`);
    if (this.file !== file) return;
    byId('steps-source', HTMLElement).textContent = text;
    byId('steps-file', HTMLElement).textContent = file;
    const own = this.passes[this.at]?.file ?? file;
    const included = [...text.matchAll(/^#include "(.+)"$/gm)].map(([, path = '']) => path);
    const links = [...(own === file ? [] : [own]), ...included].map((path) => {
      const button = Object.assign(document.createElement('button'), { type: 'button', textContent: path === own ? `back to ${path}` : path });
      button.addEventListener('click', () => void this.showSource(path));
      return button;
    });
    byId('steps-includes', HTMLElement).replaceChildren(...links);
  }
}
