// Resampled importance sampling of a sum over lights, small enough that its mean and its variance have a closed form.
import type { Random } from './random.js';
import { Reservoir } from './reservoir.js';

/** A light as one point sees it. */
export interface Light {
  /** What it would give if nothing stood in the way. */
  unshadowed: number;
  visible: boolean;
}

/** What the estimate is of: the light that arrives. */
export const arriving = (light: Light) => (light.visible ? light.unshadowed : 0);

/** What candidates are chosen by: `unshadowed` costs no ray, `arriving` would cost one for each candidate. */
export type Target = (light: Light) => number;

/** The true value: the sum over all lights. */
export const total = (lights: readonly Light[]) => lights.reduce((sum, light) => sum + arriving(light), 0);

/** One estimate of `total`: M candidates, each light alike (q = 1 / n), of which one is kept and shaded (002, Eq. 5 to 7 with N = 1). */
export function resample(lights: readonly Light[], target: Target, candidates: number, random: Random): number {
  const reservoir = new Reservoir<Light>();
  for (let at = 0; at < candidates; at++) {
    const light = lights[random.index(lights.length)] as Light;
    reservoir.update(light, target(light) * lights.length, random);
  }
  const kept = reservoir.sample;
  if (!kept) return 0;
  return (arriving(kept) / target(kept)) * (reservoir.weightSum / candidates);
}

/** Its variance in closed form (002, Eq. 17 with N = 1). */
export function resamplingVariance(lights: readonly Light[], target: Target, candidates: number): number {
  const count = lights.length;
  // With q = 1 / n an expected value over q is a sum over n, and dividing by q multiplies by n.
  const sum = (term: (light: Light) => number) => lights.reduce((all, light) => all + term(light), 0);
  const e1 = total(lights) ** 2;
  const e2 = sum((light) => (target(light) > 0 ? arriving(light) ** 2 / target(light) : 0)) * sum(target);
  const e3 = count * sum((light) => arriving(light) ** 2);
  return (e3 - e2) / candidates + (e2 - e1);
}

const light = (unshadowed: number, visible = true): Light => ({ unshadowed, visible });

/** Twelve lights as a point on a floor might see them: a few near, many far, a quarter of the brightness behind something. */
export const exampleLights: readonly Light[] = [
  light(0.4), light(0.9), light(6), light(0.3), light(1.2, false), light(9), light(0.5), light(2), light(4.5, false), light(0.2), light(3), light(0.6),
];
