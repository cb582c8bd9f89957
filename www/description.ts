// What the wasm module declares: techniques, parameters, scenes. Read once.
import type { Description, Parameter, TechniqueInfo } from './api.js';
import { describe as describeModule } from './pkg/restir.js';

let known: Description | undefined;

/** The declarations; the wasm module must be ready. */
export const description = (): Description => (known ??= JSON.parse(describeModule()) as Description);

/** The technique of that name, if there is one. */
export const techniqueOf = (id: string): TechniqueInfo | undefined => description().techniques.find((technique) => technique.id === id);

/** The declaration of `name`, `render.name` or `film.name` while `technique` is shown. */
export function parameterOf(technique: string, key: string): Parameter | undefined {
  const { film, render } = description();
  const among = (params: Parameter[] = [], prefix: string) => params.find(({ name }) => prefix + name === key);
  return among(techniqueOf(technique)?.params, '') ?? among(render.params, 'render.') ?? among(film.params, 'film.');
}

/** Whether `text` says the same as the parameter's default. */
export function isDefault(parameter: Parameter, text: string): boolean {
  return typeof parameter.default === 'number' ? Number(text) === parameter.default : text === String(parameter.default);
}

/** The value `text` as the module writes it: it reads `yes`, `on` and `1` as well. */
export function normalised(parameter: Parameter | undefined, text: string): string {
  return parameter?.kind === 'bool' ? String(['true', 'yes', 'on', '1'].includes(text)) : text;
}
