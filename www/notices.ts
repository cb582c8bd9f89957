// What the page says: messages, warnings, progress and the status line.
import type { Stats } from './api.js';
import { explain } from './messages.js';
import { type Stage, showStages } from './stages.js';

/** The element with `id`, which index.html holds. */
export function byId<T extends HTMLElement>(id: string, type: new () => T): T {
  const element = document.getElementById(id);
  if (!(element instanceof type)) throw new Error(`index.html has no ${type.name} #${id}`);
  return element;
}

const message = byId('message', HTMLElement);
const restart = byId('message-restart', HTMLButtonElement);
const closeButton = byId('message-close', HTMLButtonElement);

closeButton.addEventListener('click', () => (message.hidden = true));

/** Explains an error. With `onRestart` the page cannot go on without it; with `final` it cannot go on at all. */
export function showError(error: unknown, { onRestart, final = false }: { onRestart?: () => void; final?: boolean } = {}): void {
  const { title, text, advice } = explain(error);
  byId('message-title', HTMLElement).textContent = title;
  byId('message-text', HTMLElement).textContent = text;
  byId('message-advice', HTMLElement).textContent = advice;
  restart.hidden = onRestart === undefined;
  restart.onclick = () => {
    message.hidden = true;
    onRestart?.();
  };
  closeButton.hidden = final || onRestart !== undefined;
  message.hidden = false;
}

/** Takes a message away that no longer holds. */
export function clearError(): void {
  message.hidden = true;
}

/** Shows a load's stage, how many of how many things of it are done, how far the load is (0 to 1) and what it does. At 1 it cannot be cancelled any more. */
export function showProgress(stage: Stage, fraction: number, what: string, count?: [done: number, all: number]): void {
  byId('cancel', HTMLButtonElement).disabled = fraction === 1;
  byId('loading', HTMLElement).hidden = false;
  byId('loading-bar', HTMLProgressElement).value = fraction;
  byId('loading-text', HTMLElement).textContent = what;
  showStages(byId('stages', HTMLOListElement), stage, count);
}

/** The load has ended. */
export function hideProgress(): void {
  byId('loading', HTMLElement).hidden = true;
}

/** Lists everything that was left out, repaired or ignored. */
export function showWarnings(warnings: string[]): void {
  const details = byId('warnings', HTMLDetailsElement);
  details.hidden = warnings.length === 0;
  const summary = details.querySelector('summary');
  if (summary) summary.textContent = warnings.length === 1 ? '1 warning' : `${warnings.length} warnings`;
  const items = warnings.map((text) => Object.assign(document.createElement('li'), { textContent: text }));
  details.querySelector('ul')?.replaceChildren(...items);
}

/** A number with three digits and a letter for its size; ends with a space or that letter. */
export const withUnit = (value: number): string => {
  for (const [size, letter] of [[1e9, 'G'], [1e6, 'M'], [1e3, 'k']] as const) if (value >= size) return `${(value / size).toPrecision(3)} ${letter}`;
  return `${Math.round(value)} `;
};

export interface Status {
  frames: number;
  /** Of the last frame. */
  milliseconds: number;
  /** Rendered pixels. */
  size: [number, number];
  adapter: string;
  stats: Stats | undefined;
}

/** Frames, milliseconds, rays per second, size; and, where there are any, the values that are no numbers. */
export function showStatus({ frames, milliseconds, size, adapter, stats }: Status): void {
  const parts = [`${frames} ${frames === 1 ? 'frame' : 'frames'}`, `${milliseconds.toFixed(milliseconds < 10 ? 1 : 0)} ms`];
  if (stats && stats.rays > 0) parts.push(`${withUnit((stats.rays / milliseconds) * 1000)}rays/s`);
  parts.push(size.join('×'));
  const status = byId('status', HTMLOutputElement);
  status.textContent = parts.join(' · ');
  if (stats && stats.nan + stats.inf > 0) {
    status.append(' · ', Object.assign(document.createElement('strong'), { textContent: `${stats.nan} NaN, ${stats.inf} infinite` }));
  }
  status.title = [adapter, ...(stats?.passes ?? []).map(({ name, ms }) => `${name}: ${ms.toFixed(2)} ms`)].join('\n');
}
