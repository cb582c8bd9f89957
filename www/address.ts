// The page's address says what is shown. What a person chooses is an entry of its own in the browser's history, to which Back
// returns; what slides changes the last entry.
import type { SceneSource, Surroundings } from './protocol.js';
import { type Settings, type Unread, readQuery } from './url-state.js';

/** What an address asks for. */
export interface Address {
  state: Settings;
  /** The settings of the second picture, as a query; undefined where there is none. */
  second: string | undefined;
  /** What could not be read of the first one's. */
  unread: Unread[];
}

/** Files of the user's, which no address can hold. */
export interface OwnFiles {
  source: SceneSource;
  surroundings: Surroundings | undefined;
}

/** Reads the query of the page's address. */
export function readAddress(search: string): Address {
  const query = new URLSearchParams(search);
  const second = query.get('b') ?? undefined;
  query.delete('b');
  const { state, unread } = readQuery(query.toString());
  return { state, second, unread };
}

/** Milliseconds until a change that slides is written: browsers do not let the address change as fast as a slider moves. */
const delay = 300;

/** What the browser keeps of an entry beside its address. */
type Entry = { files: string } | null;

/** Entries outlive the page's files: those of another life of the page mean nothing to this one. */
const life = crypto.getRandomValues(new Uint32Array(2)).join('-');

const same = (href: string, entry: Entry) => href === location.href && entry?.files === (history.state as Entry)?.files;

export class PageAddress {
  /** What is to be written. */
  private pending: { href: string; entry: Entry; timer: number } | undefined;
  /** Restorations that go on: what changes meanwhile is no choice of the user's. */
  private restoring = 0;
  /** By their key, which an entry of the history keeps. They last as long as the page does. */
  private readonly files = new Map<string, OwnFiles>();

  constructor(
    /** The address of what is shown. */
    private readonly link: () => string,
    /** What is shown, where it is of files of the user's. */
    private readonly shown: () => OwnFiles | undefined,
    /** Shows what the address says that the user went back to. */
    show: (address: Address, files: OwnFiles | undefined) => Promise<void>,
  ) {
    addEventListener('popstate', () => {
      // What was about to be written belongs to an entry that has been left.
      this.drop();
      // A jump to a place in the page changes nothing.
      if (this.restoring === 0 && same(this.link(), this.entry())) return;
      void this.restore(show(readAddress(location.search), this.files.get((history.state as Entry)?.files ?? '')));
    });
  }

  /** While `work` goes on, all changes are those of the entry that is shown. */
  async restore(work: Promise<void>): Promise<void> {
    this.restoring += 1;
    await work.finally(() => (this.restoring -= 1));
    this.changed();
  }

  /** Something has changed: a moment later the last entry says so. */
  changed(): void {
    this.drop();
    this.pending = { href: this.link(), entry: this.entry(), timer: window.setTimeout(() => this.flush(), delay) };
  }

  /** The user has chosen something: it becomes an entry of its own, after the last one as it was. */
  chosen(): void {
    if (this.restoring > 0) return this.changed();
    this.flush();
    const [href, entry] = [this.link(), this.entry()];
    if (!same(href, entry)) history.pushState(entry, '', href);
  }

  private flush(): void {
    const { pending } = this;
    this.drop();
    if (pending) history.replaceState(pending.entry, '', pending.href);
  }

  private drop(): void {
    clearTimeout(this.pending?.timer);
    this.pending = undefined;
  }

  private entry(): Entry {
    const shown = this.shown();
    if (!shown) return null;
    for (const [files, { source, surroundings }] of this.files) {
      if (source === shown.source && surroundings === shown.surroundings) return { files };
    }
    const files = `${life}-${this.files.size}`;
    this.files.set(files, shown);
    return { files };
  }
}
