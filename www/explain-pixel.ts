// What the inspector saw at a pixel, in plain words.
import type { Inspection, Note } from './api.js';
import { luminance } from './vectors.js';

/** Three digits, as people write them. */
export function short(value: number): string {
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  return size >= 1e4 || size < 1e-3 ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}

/** p-hat W, where the sample is lit: what a reservoir gives. */
const estimateOf = ({ is_visible: lit, sample, unbiased_contribution_weight: w }: Note) => (lit ? (sample?.target_value ?? 0) * w : 0);

/** The reservoirs that were shaded: those that the last pass left. */
function lastResults({ notes }: Inspection): Note[] {
  const results = notes.filter(({ kind }) => kind === 'result');
  return results.filter(({ stage }) => stage === results.at(-1)?.stage);
}

/** Of the reservoirs that were shaded the one that gives most. */
export function lastResult(seen: Inspection): Note | undefined {
  const [first, ...others] = lastResults(seen);
  return first && others.reduce((most, note) => (estimateOf(note) > estimateOf(most) ? note : most), first);
}

const of = ({ notes }: Inspection, kind: Note['kind'], stage: string) => notes.filter((note) => note.kind === kind && note.stage === stage);

/** Frames of the technique in which the passes left notes, in order. */
export const stagesOf = ({ notes }: Inspection): string[] => [...new Set(notes.map(({ stage }) => stage))];

function candidateWords(seen: Inspection): string | undefined {
  const candidates = of(seen, 'candidate', 'initial');
  if (candidates.length === 0) return undefined;
  const useful = candidates.filter(({ resampling_weight: weight }) => weight > 0).length;
  return `Of ${candidates.length} candidates ${useful} would light the pixel if nothing stood between.`;
}

function historyWords(seen: Inspection): string | undefined {
  const [result] = of(seen, 'result', 'temporal');
  if (!result) return undefined;
  if (result.reason) return `No history joins: ${result.reason}.`;
  // Domain 0 is the pixel itself; each reservoir of a pixel has domains of its own.
  const joined = of(seen, 'domain', 'temporal').filter(({ slot }) => slot === 0).slice(1);
  if (joined.length === 0) return 'No history joins: no pixel of the previous frame showed a surface like this one.';
  const each = joined.map(({ pixel, confidence_weight: c }) => `what pixel ${pixel?.join(', ')} kept a frame ago, with confidence weight ${short(c)}`);
  return `History joins: ${each.join(', and ')}.`;
}

function neighbourWords(seen: Inspection): string[] {
  return stagesOf(seen).filter((stage) => stage.startsWith('spatial')).map((stage) => {
    const reason = of(seen, 'result', stage)[0]?.reason;
    if (reason) return `No neighbours join: ${reason}.`;
    // Domain 0 is the pixel itself; each reservoir of a pixel has domains of its own.
    const joined = of(seen, 'domain', stage).filter(({ slot }) => slot === 0).length - 1;
    return `${joined} ${joined === 1 ? 'neighbour joins' : 'neighbours join'}, ${of(seen, 'rejected', stage).length} are too different (${stage}).`;
  });
}

function whyWords(seen: Inspection, last: Note): string[] {
  const shown = luminance(seen.radiance);
  const mean = luminance(seen.mean);
  const sample = last.sample;
  if (!sample) return ['Nothing was chosen: no candidate, and nothing that joined, carries light to this pixel. Direct light is black in this frame.'];
  const kind = sample.light_kind === 'triangle' ? 'a glowing triangle' : `the ${sample.light_kind} light`;
  const count = lastResults(seen).length;
  const chosen = `Light ${sample.light}, ${kind}, was chosen${count > 1 ? ` by the one of ${count} reservoirs that gives most` : ''}`;
  if (last.unbiased_contribution_weight === 0) return [`${chosen}, and found to be in shadow: its weight is 0, and direct light is black in this frame.`];
  if (!last.is_visible) return [`${chosen}, and something stands between: direct light is black in this frame.`];
  const words = [`${chosen}; it is seen from here, and lights the pixel with p̂ · W = ${short(sample.target_value * last.unbiased_contribution_weight)}.`];
  if (seen.samples > 4 && shown > 4 * mean && mean > 0) {
    words.push(`This frame is ${short(shown / mean)} times as bright as the mean of ${seen.samples}: its W of ${short(last.unbiased_contribution_weight)} is large, for such a sample is seldom found.`);
  }
  return words;
}

/** Why the pixel is as it is: sentences, the most important first. */
export function explainPixel(seen: Inspection): string[] {
  if (!seen.surface) return ['There is no surface: the pixel shows the background.'];
  const words: string[] = [];
  if (luminance(seen.surface.emission) > 0) words.push('The surface shines itself; what it reflects comes on top.');
  const last = lastResult(seen);
  if (!last) words.push('There are no notes on what was sampled: a path tracer keeps none, nor does a view of the surface.');
  else words.push(...whyWords(seen, last));
  return [...words, candidateWords(seen), historyWords(seen), ...neighbourWords(seen)].filter((text) => text !== undefined);
}
