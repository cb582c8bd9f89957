// Files that a person picked or dropped, to a scene to load.
import type { SceneSource, Surroundings } from './protocol.js';

async function read(file: File): Promise<{ name: string; bytes: Uint8Array }> {
  try {
    return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
  } catch (error) {
    throw { code: 'IO', message: `${file.name}: ${(error as Error).message}` };
  }
}

/** Reads `files`: a scene, an environment map, or both. Rejects with NOT_A_SCENE or IO. */
export async function readDropped(files: readonly File[]): Promise<{ source?: SceneSource; surroundings?: Surroundings }> {
  const isMap = ({ name }: File) => /\.(hdr|exr)$/i.test(name);
  const map = files.find(isMap);
  const others = files.filter((file) => !isMap(file));
  return {
    ...(map && { surroundings: await read(map) }),
    ...((others.length > 0 || !map) && { source: await readFiles(others) }),
  };
}

/** What the address or the menu calls: a name that the module knows, or the address of a map. */
export function surroundingsOf(text: string): Surroundings {
  return /^(sky|white)(:|$)/.test(text) ? { name: text } : { name: text, address: new URL(text, location.href).href };
}

/** Reads `files`, of which one is a .glb or .gltf. Rejects with NOT_A_SCENE or IO. */
export async function readFiles(files: readonly File[]): Promise<SceneSource> {
  const main = files.find(({ name }) => /\.(glb|gltf)$/i.test(name));
  if (!main) throw { code: 'NOT_A_SCENE', message: `${files.map(({ name }) => name).join(', ') || 'Nothing'} is neither .glb nor .gltf, nor an environment map, .hdr or .exr.` };
  return { kind: 'file', name: main.name, files: await Promise.all(files.map(read)) };
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
