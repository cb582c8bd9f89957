// The settings panel, generated from the parameter declarations.
import type { BiasNote, Parameter } from './api.js';
import { isDefault } from './description.js';
import { make } from './elements.js';

export interface Group {
  title: string;
  /** What stands before the names in keys: '' or, for example, 'film.'. */
  prefix: string;
  params: Parameter[];
}

/** Tells of a new value, or with undefined of a return to the default. */
export type ParameterChanged = (key: string, value: string | undefined) => void;

/** Fills a menu with (value, text) pairs and selects `chosen`, which is added where it is not among them. */
export function fillMenu(menu: HTMLSelectElement, entries: [string, string][], chosen: string): void {
  const all: [string, string][] = entries.some(([value]) => value === chosen) ? entries : [...entries, [chosen, chosen]];
  menu.replaceChildren(...all.map(([value, text]) => new Option(text, value, false, value === chosen)));
  menu.value = chosen;
}

interface Field {
  elements: HTMLElement[];
  /** Shows a value that came from elsewhere. */
  show(text: string): void;
}

function checkbox(id: string, changed: (text: string) => void): Field {
  const input = make('input', { id, type: 'checkbox', className: 'alone' });
  input.addEventListener('change', () => changed(String(input.checked)));
  return { elements: [input], show: (text) => (input.checked = text === 'true') };
}

function choice(id: string, choices: string[], changed: (text: string) => void): Field {
  const menu = make('select', { id });
  fillMenu(menu, choices.map((name) => [name, name]), choices[0] ?? '');
  menu.addEventListener('change', () => changed(menu.value));
  return { elements: [menu], show: (text) => (menu.value = text) };
}

/** A number field, with a slider where the range has two ends. Wide positive ranges slide in powers. */
function numeric(id: string, parameter: Parameter, changed: (text: string) => void): Field {
  const { min, max, kind } = parameter;
  const whole = kind === 'u32';
  const input = make('input', { id, type: 'number', step: whole ? '1' : 'any' });
  if (min !== undefined) input.min = String(min);
  if (max !== undefined) input.max = String(max);
  input.addEventListener('change', () => input.value !== '' && input.checkValidity() && changed(input.value));
  if (min === undefined || max === undefined || !Number.isFinite(max - min)) {
    input.className = 'alone';
    return { elements: [input], show: (text) => (input.value = text) };
  }
  const powers = min > 0 && max / min >= 100;
  const [to, from] = powers ? [Math.log, Math.exp] : [(value: number) => value, (value: number) => value];
  const step = whole && !powers ? 1 : (to(max) - to(min)) / 200;
  const slider = make('input', { type: 'range', min: String(to(min)), max: String(to(max)), step: String(step) });
  slider.setAttribute('aria-label', `${parameter.name}, slider`);
  slider.addEventListener('input', () => {
    const value = Math.min(Math.max(from(Number(slider.value)), min), max);
    input.value = String(whole ? Math.round(value) : Number(value.toPrecision(3)));
    changed(input.value);
  });
  const show = (text: string) => {
    input.value = text;
    slider.setAttribute('aria-valuetext', text);
    // While it is held it is where the hand has put it: a step of a power may be less than a whole number.
    if (!slider.matches(':focus')) slider.value = String(to(Number(text)));
  };
  return { elements: [slider, input], show };
}

function field(id: string, parameter: Parameter, changed: (text: string) => void): Field {
  switch (parameter.kind) {
    case 'bool':
      return checkbox(id, changed);
    case 'choice':
      return choice(id, parameter.choices ?? [], changed);
    default:
      return numeric(id, parameter, changed);
  }
}

function row(key: string, parameter: Parameter, value: string | undefined, changed: ParameterChanged): HTMLElement {
  const id = `parameter-${key}`;
  const standard = String(parameter.default);
  const back = make('button', { type: 'button', className: 'default', textContent: '↺', title: `Back to ${standard}` });
  back.setAttribute('aria-label', `${parameter.name}: back to ${standard}`);
  const { elements, show } = field(id, parameter, (text) => {
    back.disabled = isDefault(parameter, text);
    show(text);
    changed(key, back.disabled ? undefined : text);
  });
  back.disabled = value === undefined;
  back.addEventListener('click', () => {
    show(standard);
    back.disabled = true;
    changed(key, undefined);
  });
  show(value ?? standard);

  const unit = parameter.unit ? ` (${parameter.unit})` : '';
  const label = make('label', { htmlFor: id, textContent: parameter.name.replaceAll('_', ' ') + unit });
  const doc = make('small', { id: `${id}-doc`, textContent: parameter.doc });
  for (const element of elements) element.setAttribute('aria-describedby', doc.id);
  const whole = make('div', { className: 'parameter', title: parameter.doc });
  whole.dataset.key = key;
  whole.append(label, ...elements, back, make('strong', { className: 'bias', hidden: true }), doc);
  return whole;
}

/** Shows only those parameters whose name or text has all words of `text`. */
export function filterPanel(root: HTMLElement, text: string): void {
  const words = text.toLowerCase().split(/\s+/);
  for (const fieldset of root.querySelectorAll('fieldset')) {
    const rows = [...fieldset.querySelectorAll<HTMLElement>('.parameter')];
    for (const row of rows) row.hidden = !words.every((word) => row.textContent?.toLowerCase().includes(word));
    fieldset.hidden = rows.every((row) => row.hidden);
  }
}

/** Shows `groups` in `root`, with the `values` that differ from their defaults. */
export function showPanel(root: HTMLElement, groups: Group[], values: ReadonlyMap<string, string>, changed: ParameterChanged): void {
  const fieldsets = groups.filter(({ params }) => params.length > 0).map(({ title, prefix, params }) => {
    const fieldset = document.createElement('fieldset');
    const rows = params.map((parameter) => row(prefix + parameter.name, parameter, values.get(prefix + parameter.name), changed));
    fieldset.append(make('legend', { textContent: title }), ...rows);
    return fieldset;
  });
  root.replaceChildren(...fieldsets);
}

/** Marks those parameters whose values bias the picture. */
export function markBiases(root: HTMLElement, biases: BiasNote[]): void {
  for (const row of root.querySelectorAll<HTMLElement>('.parameter')) {
    const mark = row.querySelector<HTMLElement>('.bias');
    const found = biases.find(({ parameter }) => parameter === row.dataset.key);
    if (!mark) continue;
    mark.hidden = !found;
    mark.textContent = found ? `Biased: ${found.why}.` : '';
  }
}
