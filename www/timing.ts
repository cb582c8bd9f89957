// Where a frame's time goes on the GPU: a bar of its passes, and their figures; and the memory that is held.
import type { Memory, Stats } from './api.js';
import { make } from './elements.js';
import { byId } from './notices.js';

/** Passes beyond these share the last colour. */
const colours = 8;

/** Bytes as megabytes: millions. */
const mega = (bytes: number) => (bytes / 1e6).toFixed(1);

/** `GPU 12.3 MB (scene 8.1, film 2.0, technique 2.2), WebAssembly 6.4 MB`. */
function memoryText({ scene, film, technique, inspector, wasm, heap }: Memory): string {
  const parts = [`scene ${mega(scene)}`, `film ${mega(film)}`, `technique ${mega(technique)}`, ...(inspector > 0 ? [`inspector ${mega(inspector)}`] : [])];
  const script = heap === undefined ? '' : `, JavaScript ${mega(heap)} MB`;
  return `GPU ${mega(scene + film + technique + inspector)} MB (${parts.join(', ')}), WebAssembly ${mega(wasm)} MB${script}`;
}

/** Shows the passes of the last frame, and memory; says so where the device cannot measure passes. */
export function showTiming({ passes, memory }: Stats): void {
  const root = byId('timing', HTMLDetailsElement);
  if (!root.open) return;
  const held = byId('memory', HTMLElement);
  held.textContent = memoryText(memory);
  held.hidden = false;
  const total = passes.reduce((sum, { ms }) => sum + ms, 0);
  const colour = (index: number) => `pass-${Math.min(index, colours - 1)}`;
  const bar = make('div', { className: 'bar', ariaHidden: 'true' });
  for (const [index, { ms }] of passes.entries()) {
    const part = make('span', { className: colour(index) });
    part.style.flexGrow = String(total > 0 ? ms / total : 0);
    bar.append(part);
  }
  const rows = passes.map(({ name, ms }, index) =>
    make(
      'tr',
      {},
      make('th', { scope: 'row' } as Partial<HTMLElement>, make('i', { className: colour(index) }), document.createTextNode(name)),
      make('td', { textContent: `${ms.toFixed(2)} ms` }),
      make('td', { textContent: total > 0 ? `${Math.round((100 * ms) / total)} %` : '' }),
    ),
  );
  const sum = make('tr', {}, make('th', { scope: 'row', textContent: 'all' } as Partial<HTMLElement>), make('td', { textContent: `${total.toFixed(2)} ms` }), make('td', {}));
  const none = make('p', { textContent: 'This device does not tell how long passes take.' });
  byId('passes', HTMLElement).replaceChildren(...(passes.length > 0 ? [bar, make('table', {}, ...rows, sum)] : [none]));
}
