// Files that a person picked or dropped, to a scene to load; and files that are saved.
import type { SceneSource, Surroundings } from './protocol.js';

async function read(file: File): Promise<{ name: string; bytes: Uint8Array }> {
  try {
    return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
  } catch (error) {
    throw { code: 'IO', message: `${file.name}: ${(error as Error).message}` };
  }
}

/** What `files` are: a scene, an environment map (which is read), or both. Rejects with NOT_A_SCENE or IO. */
export async function readDropped(files: readonly File[]): Promise<{ source?: SceneSource; surroundings?: Surroundings }> {
  const isMap = ({ name }: File) => /\.(hdr|exr)$/i.test(name);
  const map = files.find(isMap);
  const others = files.filter((file) => !isMap(file));
  return {
    ...(map && { surroundings: await read(map) }),
    ...((others.length > 0 || !map) && { source: sceneOf(others) }),
  };
}

/** What the address or the menu calls: a name that the module knows, or the address of a map. */
export function surroundingsOf(text: string): Surroundings {
  if (/^(sky|white)(:|$)/.test(text)) return { name: text };
  if (!URL.canParse(text, document.baseURI)) throw { code: 'BAD_VALUE', message: `${text} is no address.` };
  return { name: text, address: new URL(text, document.baseURI).href };
}

/**
 * What `scene=` in an address and `src` of an element call. With a dot or a slash it is the address of a .glb, .gltf, .obj or
 * .restir, relative to the document; else a built-in scene, with or without `builtin:` as on the command line.
 */
export function sourceOf(text: string): SceneSource {
  const builtin = /^builtin:/.test(text);
  if (builtin || !/[./]/.test(text)) return { kind: 'builtin', name: builtin ? text.slice('builtin:'.length) : text };
  if (!URL.canParse(text, document.baseURI)) throw { code: 'BAD_VALUE', message: `${text} is no address.` };
  const { href, pathname, protocol } = new URL(text, document.baseURI);
  const name = protocol === 'data:' ? 'data' : pathname.slice(pathname.lastIndexOf('/') + 1) || text;
  return { kind: 'address', name, address: href, choice: {} };
}

/** The scene among `files`: a .glb, .gltf, .obj or .restir. Throws NOT_A_SCENE. The worker reads them. */
export function sceneOf(files: readonly File[]): SceneSource {
  const main = files.find(({ name }) => /\.(glb|gltf|obj|restir)$/i.test(name));
  if (!main) {
    const names = files.map(({ name }) => name).join(', ') || 'Nothing';
    throw { code: 'NOT_A_SCENE', message: `${names} is neither .glb, .gltf, .obj nor .restir, nor an environment map, .hdr or .exr.` };
  }
  return { kind: 'file', name: main.name, files: [...files], choice: {} };
}

/** Saves a file under a name, as a download. */
export function save(file: Blob, name: string): void {
  const href = URL.createObjectURL(file);
  Object.assign(document.createElement('a'), { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 60_000);
}

/** Calls `dropped` with what is dropped anywhere on the page; `hint` is shown while something hovers. */
export function acceptDrops(hint: HTMLElement, dropped: (files: File[]) => void): void {
  const withFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
  addEventListener('dragover', (event) => {
    if (!withFiles(event)) return;
    event.preventDefault();
    hint.hidden = false;
  });
  addEventListener('dragleave', (event) => {
    // Without a related target the pointer left the window, not one element for another.
    if (!event.relatedTarget) hint.hidden = true;
  });
  addEventListener('drop', (event) => {
    if (!withFiles(event)) return;
    event.preventDefault();
    hint.hidden = true;
    dropped([...(event.dataTransfer?.files ?? [])]);
  });
}
