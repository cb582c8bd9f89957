// Files that a person picked or dropped, to a scene to load.
import type { SceneSource } from './protocol.js';

/** The scene among `files`: a .glb, .gltf, .obj or .restir. Throws NOT_A_SCENE. The worker reads them. */
export function sceneOf(files: readonly File[]): SceneSource {
  const main = files.find(({ name }) => /\.(glb|gltf|obj|restir)$/i.test(name));
  if (!main) {
    const names = files.map(({ name }) => name).join(', ') || 'Nothing';
    throw { code: 'NOT_A_SCENE', message: `${names} is neither .glb, .gltf, .obj nor .restir.` };
  }
  return { kind: 'file', name: main.name, files: [...files], choice: {} };
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
