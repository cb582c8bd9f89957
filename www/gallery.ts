// The gallery: all built-in scenes as pictures, in a dialog that is made, and whose pictures are fetched, when it is first opened.
import type { SceneInfo } from './api.js';
import { make } from './elements.js';

const own = 'Our own';

/** Whose idea a built-in scene is. The geometry of all is computed by restir, and under its licence. */
export const credits: Record<string, string> = {
  cornell: 'After that of Cornell University’s Program of Computer Graphics, near to its measures',
  'cornell-64': 'After a report on ReSTIR of 2025; the box after that of Cornell University’s Program of Computer Graphics',
  furnace: 'The customary furnace test',
  'veach-mis': 'After figure 9.2 of Eric Veach’s thesis, 1997; measures are our own',
  'many-lights': own,
  hall: own,
  arcade: `${own}, for scenes like the Amusement Park of Wyman and Panteleev, 2021`,
  city: `${own}, for night scenes like those of Wyman and Panteleev, 2021`,
  torches: `${own}, for worlds like that of figure 20 of Wyman and Panteleev, 2021`,
  'glossy-spheres': own,
  materials: own,
  'area-lights': own,
  motion: own,
  switching: own,
};

/** Where more scenes are. */
const samples = 'https://github.com/KhronosGroup/glTF-Sample-Assets';

/** What is done with what was chosen. */
export interface GalleryActions {
  /** Shows a built-in scene, by a name that can be loaded. */
  show(scene: string): void;
  /** Lets the user pick files. */
  pick(): void;
}

const address = (file: string) => new URL(`./gallery/${file}`, import.meta.url).href;

/** A scene as a button: its picture, what it is called, what it is, and whose. */
function card({ name, title, doc }: SceneInfo): HTMLButtonElement {
  const picture = make('img', { src: address(`${name}.webp`), alt: '', width: 288, height: 192, loading: 'lazy' });
  const words = [make('b', {}, title), make('span', {}, doc), make('small', {}, `${credits[name] ?? own}.`)];
  return make('button', { type: 'button', value: name }, picture, ...words);
}

/** How many buttons stand in the first line. */
const columns = (all: HTMLButtonElement[]) => Math.max(1, all.filter(({ offsetTop }) => offsetTop === all[0]?.offsetTop).length);

/** Where a key leads from the button with index `at`; undefined where it is none that moves. */
function moved(key: string, at: number, all: HTMLButtonElement[]): number | undefined {
  const steps: Record<string, number> = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns(all), ArrowDown: columns(all) };
  if (key === 'Home') return 0;
  if (key === 'End') return all.length - 1;
  const step = steps[key];
  return step === undefined ? undefined : Math.min(Math.max(at + step, 0), all.length - 1);
}

function build(scenes: SceneInfo[], { show, pick }: GalleryActions): HTMLDialogElement {
  const cards = scenes.map((scene) => {
    const button = card(scene);
    button.addEventListener('click', () => {
      dialog.close();
      show(scene.example);
    });
    return button;
  });
  const list = make('ul', {}, ...cards.map((button) => make('li', {}, button)));
  list.addEventListener('keydown', (event) => {
    const at = cards.indexOf(document.activeElement as HTMLButtonElement);
    const next = at < 0 ? undefined : moved(event.key, at, cards);
    if (next === undefined) return;
    event.preventDefault();
    cards[next]?.focus();
  });
  const close = make('button', { type: 'button', textContent: 'Close' });
  const file = make('button', { type: 'button', id: 'gallery-own', textContent: 'Your own file…' });
  const more = make('a', { href: samples, target: '_blank', rel: 'noopener' }, 'Khronos’ glTF sample assets');
  const dialog = make(
    'dialog',
    { id: 'gallery-dialog' },
    make('header', {}, make('h2', { id: 'gallery-title', textContent: 'Scenes' }), make('span', {}, 'computed by restir, and like it under MIT or Apache-2.0'), close),
    list,
    make('p', {}, file, ' ', make('span', {}, 'A .glb or .restir, a .gltf or .obj with its files. More of them: ', more, ', each under a licence of its own.')),
  );
  dialog.setAttribute('aria-labelledby', 'gallery-title');
  close.addEventListener('click', () => dialog.close());
  file.addEventListener('click', () => {
    dialog.close();
    pick();
  });
  // A click beside it closes it, as Escape does.
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close());
  return dialog;
}

let gallery: HTMLDialogElement | undefined;

/** Opens the gallery at the scene that is shown, `current`, if that is built in. */
export function openGallery(scenes: SceneInfo[], current: string | undefined, actions: GalleryActions): void {
  if (!gallery) document.body.append((gallery = build(scenes, actions)));
  const name = current?.replace(/^builtin:/, '').split(':')[0];
  const cards = [...gallery.querySelectorAll<HTMLButtonElement>('li button')];
  for (const button of cards) {
    if (button.value === name) button.setAttribute('aria-current', 'true');
    else button.removeAttribute('aria-current');
  }
  gallery.showModal();
  (cards.find(({ value }) => value === name) ?? cards[0])?.focus();
}
