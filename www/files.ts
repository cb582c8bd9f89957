// Files that a person picked or dropped, to a scene to load.
import type { SceneSource } from './protocol.js';

/** Reads `files`, of which one is a .glb or .gltf. Rejects with NOT_A_SCENE or IO. */
export async function readFiles(files: readonly File[]): Promise<SceneSource> {
  const main = files.find(({ name }) => /\.(glb|gltf)$/i.test(name));
  if (!main) throw { code: 'NOT_A_SCENE', message: `${files.map(({ name }) => name).join(', ') || 'Nothing'} is neither .glb nor .gltf.` };
  const read = async (file: File) => {
    try {
      return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
    } catch (error) {
      throw { code: 'IO', message: `${file.name}: ${(error as Error).message}` };
    }
  };
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
