// What was read of frames, and its layers by pass.
import type { Stats } from './api.js';

export interface Reading {
  passes: Stats['passes'];
  rays: number;
  /** Of the whole frame. */
  milliseconds: number;
}

/** The passes of all readings by name, in the order of their first appearance; where the device measures none, the frame as a whole. */
export function layersOf(readings: readonly Reading[]): { name: string; values: number[] }[] {
  const measured = readings.some(({ passes }) => passes.length > 0);
  const passesOf = ({ passes, milliseconds }: Reading) => (measured ? passes : [{ name: 'frame', ms: milliseconds }]);
  const names = [...new Set(readings.flatMap((reading) => passesOf(reading).map(({ name }) => name)))];
  return names.map((name) => ({ name, values: readings.map((reading) => passesOf(reading).find((pass) => pass.name === name)?.ms ?? 0) }));
}
