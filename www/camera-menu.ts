// The menu of cameras: those of the scene, and the views that a person has kept.
import type { Pose } from './api.js';
import { Bookmarks } from './bookmarks.js';
import { byId, showError } from './notices.js';
import type { RestirViewer } from './viewer.js';

/** Stands before the place of a bookmark in the menu's values; cameras are their indices. */
const mark = 'view-';
/** The value of the entry for a camera that has been moved to where no entry is. */
const moved = '';

export class CameraMenu {
  private readonly menu = byId('camera', HTMLSelectElement);
  private readonly row = byId('bookmark-row', HTMLElement);
  private readonly name = byId('bookmark-name', HTMLInputElement);
  /** Where the bookmark is whose name is being typed. */
  private naming: Pose | undefined;

  constructor(private readonly view: RestirViewer) {
    this.menu.addEventListener('change', () => this.go(this.menu.value));
    byId('keep-view', HTMLButtonElement).addEventListener('click', () => this.keep());
    byId('bookmark-delete', HTMLButtonElement).addEventListener('click', () => this.change((bookmarks, at) => bookmarks.remove(at)));
    this.name.addEventListener('focus', () => (this.naming = view.settings.pose));
    this.name.addEventListener('change', () => this.rename());
    this.name.addEventListener('blur', () => (this.naming = undefined));
    view.addEventListener('camera-change', () => this.choose());
    view.addEventListener('load', () => this.show());
  }

  /** Goes to the entry of this number, from 1; does nothing where there is none. */
  goTo(number: number): void {
    const entry = [...this.menu.options].filter(({ value }) => value !== moved)[number - 1];
    if (entry) this.go(entry.value);
  }

  private get bookmarks(): Bookmarks {
    const { scene = this.view.scene?.source.name ?? '', sceneIndex } = this.view.settings;
    // A file may hold several scenes; the first goes by the file's name alone.
    return new Bookmarks(sceneIndex ? `${scene}#${sceneIndex}` : scene);
  }

  private show(): void {
    const cameras = (this.view.scene?.cameras ?? []).map(({ name }, index) => new Option(name || `camera ${index}`, String(index)));
    const views = this.bookmarks.all.map(({ name }, index) => new Option(name, mark + String(index)));
    const group = Object.assign(document.createElement('optgroup'), { label: 'Bookmarks' });
    group.append(...views);
    const elsewhere = Object.assign(new Option('moved', moved), { hidden: true });
    this.menu.replaceChildren(...cameras, ...(views.length > 0 ? [group] : []), elsewhere);
    this.choose();
  }

  /** Selects the entry at which the camera is. */
  private choose(): void {
    const { pose } = this.view.settings;
    // What is being typed is the name of the view that the camera leaves.
    const leaves = this.naming !== undefined && this.naming !== pose;
    if (leaves) this.rename();
    const at = this.bookmarks.find(pose);
    this.menu.value = at >= 0 ? mark + String(at) : pose ? moved : String(this.view.cameraIndex);
    this.row.hidden = at < 0;
    const named = this.bookmarks.all[at]?.name;
    if (named !== undefined && (leaves || document.activeElement !== this.name)) this.name.value = named;
  }

  private go(entry: string): void {
    if (!entry.startsWith(mark)) return void this.view.setCamera(Number(entry));
    const bookmark = this.bookmarks.all[Number(entry.slice(mark.length))];
    if (!bookmark) return this.show();
    // For its lens; both before the next frame.
    void this.view.setCamera(bookmark.camera);
    void this.view.setCamera(bookmark.pose);
  }

  private keep(): void {
    const { bookmarks, view } = this;
    if (!view.scene || bookmarks.find(view.settings.pose) >= 0) return;
    const pose = view.camera();
    try {
      bookmarks.add(view.settings.camera, pose);
    } catch (error) {
      return showError({ code: 'STORAGE', message: (error as Error).message });
    }
    // A camera of the scene, too, is kept as a place: there the picture is now.
    view.setCamera(pose).then(() => this.show(), () => undefined);
  }

  private rename(): void {
    const { naming } = this;
    this.naming = undefined;
    this.change((bookmarks, at) => bookmarks.rename(at, this.name.value.trim() || `View ${at + 1}`), naming);
  }

  private change(work: (bookmarks: Bookmarks, at: number) => void, pose = this.view.settings.pose): void {
    const at = this.bookmarks.find(pose);
    try {
      if (at >= 0) work(this.bookmarks, at);
    } catch (error) {
      showError({ code: 'STORAGE', message: (error as Error).message });
    }
    this.show();
  }
}
