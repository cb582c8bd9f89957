// Views that a person has kept, by scene, in the browser's storage.
import type { Pose } from './api.js';
import { poseText } from './url-state.js';

export interface Bookmark {
  name: string;
  /** The scene's camera through whose lens is looked. */
  camera: string;
  pose: Pose;
}

const key = 'restir.bookmarks';

type Kept = Record<string, Bookmark[]>;

/** What is in the storage; nothing where the browser has none, or something else is there. */
function read(): Kept {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(key) ?? '{}');
    return typeof kept === 'object' && kept !== null ? (kept as Kept) : {};
  } catch {
    return {};
  }
}

const isVector = (value: unknown) => Array.isArray(value) && value.length === 3 && value.every(Number.isFinite);

const isBookmark = (value: Partial<Bookmark> | null): value is Bookmark =>
  typeof value?.name === 'string' && typeof value.camera === 'string' && [value.pose?.position, value.pose?.forward, value.pose?.up].every(isVector);

/** The bookmarks of one scene. */
export class Bookmarks {
  constructor(private readonly scene: string) {}

  get all(): Bookmark[] {
    const list: unknown = read()[this.scene];
    // What something else has written there is passed over.
    return Array.isArray(list) ? (list as (Partial<Bookmark> | null)[]).filter(isBookmark) : [];
  }

  /** The place of the bookmark at which the camera is; -1 where it is at none. */
  find(pose: Pose | undefined): number {
    return pose ? this.all.findIndex((bookmark) => poseText(bookmark.pose) === poseText(pose)) : -1;
  }

  /** Throws what the browser says where it keeps nothing. */
  add(camera: string, pose: Pose): void {
    const { position, forward, up } = pose;
    // A number of its own, also after others are deleted.
    const numbers = this.all.map(({ name }) => Number(/^View (\d+)$/.exec(name)?.[1] ?? 0));
    this.write([...this.all, { name: `View ${Math.max(0, ...numbers) + 1}`, camera, pose: { position, forward, up } }]);
  }

  rename(at: number, name: string): void {
    this.write(this.all.map((bookmark, index) => (index === at ? { ...bookmark, name } : bookmark)));
  }

  remove(at: number): void {
    this.write(this.all.filter((_, index) => index !== at));
  }

  private write(list: Bookmark[]): void {
    const { [this.scene]: _, ...others } = read();
    localStorage.setItem(key, JSON.stringify(list.length > 0 ? { ...others, [this.scene]: list } : others));
  }
}
