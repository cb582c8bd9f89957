// What the colours of a view mean: words, and of a number the colour map with its ends.
import type { ViewLegend } from './api.js';
import { byId } from './notices.js';
import type { RestirViewer } from './viewer.js';

/** The share of pixels that may lie beyond either end after a fit. */
const beyond = 0.01;

/** What the parameters of the range take. */
const furthest = 1e9;

/** A number with four figures, as people and parameters read it. */
const fourFigures = (value: number) => String(Number(value.toPrecision(4)));

/** The ends of the numbers of a picture, those of few pixels left out; undefined where all are alike. */
export function fittedRange(values: Float32Array, logarithmic: boolean): [number, number] | undefined {
  const sorted = values.filter((value) => Number.isFinite(value) && (!logarithmic || value > 0)).sort();
  const at = (share: number) => sorted[Math.round(share * (sorted.length - 1))] ?? 0;
  const ends = (share: number) => [at(share), at(1 - share)].map((value) => Number(fourFigures(Math.min(Math.max(value, -furthest), furthest)))) as [number, number];
  // Where nearly all are alike, the few others count.
  const [low, high] = ends(beyond);
  const [least, most] = ends(0);
  return low < high ? [low, high] : least < most ? [least, most] : undefined;
}

export class Legend {
  private readonly whole = byId('legend', HTMLElement);
  private shown: ViewLegend | undefined;

  /** `setRange` sets the parameters of the range; without a range they go back to their defaults. */
  constructor(
    private readonly viewer: () => RestirViewer,
    private readonly setRange: (range: [number, number] | undefined) => void,
  ) {
    byId('legend-fit', HTMLButtonElement).addEventListener('click', () => void this.fit());
    byId('legend-own', HTMLButtonElement).addEventListener('click', () => this.forgetRange());
  }

  /** Goes back to the view's own range, where another is set. */
  forgetRange(): void {
    const { values } = this.viewer().settings;
    if (values.has('film.range_low') || values.has('film.range_high')) this.setRange(undefined);
  }

  /** Asks what is shown now. */
  async update(): Promise<void> {
    const viewer = this.viewer();
    const legend = await viewer.legend().catch(() => undefined);
    if (viewer !== this.viewer() || !legend) return;
    this.shown = legend;
    this.whole.hidden = legend.name === 'radiance';
    byId('legend-words', HTMLElement).textContent = legend.meaning;
    const { colors, low = 0, high = 1, unit = '', logarithmic } = legend;
    byId('legend-scale', HTMLElement).hidden = !colors;
    if (!colors) return;
    const bar = byId('legend-bar', HTMLElement);
    bar.style.background = `linear-gradient(to right, ${colors.join(', ')})`;
    bar.ariaLabel = `Colours from ${fourFigures(low)} to ${fourFigures(high)} ${unit}${logarithmic ? ', by magnitude' : ''}`;
    byId('legend-low', HTMLElement).textContent = fourFigures(low);
    byId('legend-unit', HTMLElement).textContent = logarithmic ? `${unit}, by magnitude` : unit;
    byId('legend-high', HTMLElement).textContent = fourFigures(high);
    const { values } = viewer.settings;
    byId('legend-own', HTMLButtonElement).disabled = !values.has('film.range_low') && !values.has('film.range_high');
  }

  /** Takes the ends from what is in the picture. */
  private async fit(): Promise<void> {
    const picture = await this.viewer().readPicture().catch(() => undefined);
    if (!picture) return;
    const range = fittedRange(picture.pixels.filter((_, at) => at % 3 === 0), this.shown?.logarithmic ?? false);
    if (range) this.setRange(range);
    else byId('legend-unit', HTMLElement).textContent = 'all alike: nothing to fit';
  }
}
