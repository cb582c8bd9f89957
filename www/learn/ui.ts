// What the toys' pages have in common: finding elements, writing numbers, drawing, and running many times.

/** The element with this id; a page without it is a mistake. */
export function byId<Type extends Element = HTMLElement>(id: string): Type {
  const element = document.getElementById(id);
  if (!element) throw new Error(`no element #${id}`);
  return element as Element as Type;
}

/** Three significant digits, or a dash for what is not known yet. */
export const short = (value: number) => (Number.isFinite(value) ? Number(value.toPrecision(3)).toString().replace('-', '−') : '–');

/** A mean and its standard error, with as many digits as the error deserves. */
export function withError(mean: number, error: number): string {
  if (!(error > 0)) return short(mean);
  const digits = Math.max(0, 1 - Math.floor(Math.log10(error)));
  return `${mean.toFixed(digits)} ± ${error.toFixed(digits)}`;
}

/** Writes a number to be read, and in full to `data-value`, where programs can read it. */
export function show(element: HTMLElement, value: number, text = short(value)): void {
  element.textContent = text;
  element.dataset['value'] = String(value);
}

/** An element of an SVG picture. */
export function shape(name: string, attributes: Record<string, string | number>, text = ''): SVGElement {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.textContent = text;
  return element;
}

/** Calls `act` now and whenever a slider or choice changes. */
export function follow(inputs: Iterable<HTMLElement>, act: () => void): void {
  for (const input of inputs) input.addEventListener('input', act);
  act();
}

const inSteps = 20;

/**
 * A button that does `runs` runs, in steps that can be watched; all at once for those who asked for less motion. `draw` shows what
 * has come of them. Pressed again meanwhile it adds to what is to do.
 */
export function runner(button: HTMLElement, runs: number, work: () => void, draw: () => void): { stop: () => void } {
  let left = 0;
  const some = () => {
    const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
    const now = still ? left : Math.min(left, Math.ceil(runs / inSteps));
    for (let run = 0; run < now; run++) work();
    left -= now;
    draw();
    if (left > 0) requestAnimationFrame(some);
  };
  button.addEventListener('click', () => {
    const idle = left === 0;
    left += runs;
    if (idle) some();
  });
  return { stop: () => (left = 0) };
}
