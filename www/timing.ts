// Where a frame's time goes on the GPU: a bar of its passes, and their figures.
import type { Stats } from './api.js';
import { make } from './elements.js';
import { byId } from './notices.js';

/** Passes beyond these share the last colour. */
const colours = 8;

/** Shows the passes of the last frame; says so where the device cannot measure them. */
export function showTiming({ passes }: Stats): void {
  const root = byId('timing', HTMLDetailsElement);
  if (!root.open) return;
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
