// Gives a renderer what settings say, and keeps them as it takes them.
import { description, isDefault, normalised, parameterOf, techniqueOf } from './description.js';
import { toFailure } from './messages.js';
import type { Viewer } from './pkg/restir.js';
import { type Settings, defaultSettings } from './url-state.js';
import type { ViewerFailure } from './viewer-events.js';

/** What a renderer takes is kept in the settings; what it refuses is told, or thrown. */
export class SettingsTaker {
  constructor(
    private readonly settings: Settings,
    /** Told of a setting that was not taken. */
    private readonly refused: (failure: ViewerFailure) => void,
  ) {}

  /** Sets a parameter. Throws `UNKNOWN_NAME` or `BAD_VALUE`. */
  takeValue(viewer: Viewer, key: string, value: string): void {
    const { technique, values } = this.settings;
    const parameter = parameterOf(technique, key);
    viewer.set(key, value);
    const text = normalised(parameter, value);
    if (parameter && isDefault(parameter, text)) values.delete(key);
    else values.set(key, text);
  }

  /** Switches to another technique, with its own defaults. Throws `UNKNOWN_NAME`. */
  takeTechnique(viewer: Viewer, id: string): void {
    const { settings } = this;
    viewer.set_technique(id);
    settings.technique = id;
    for (const key of [...settings.values.keys()].filter((name) => !name.includes('.'))) settings.values.delete(key);
    if (!techniqueOf(id)?.views.some(({ name }) => name === settings.view)) settings.view = 'radiance';
    viewer.set_view(settings.view);
  }

  /** Switches to a preset: its technique, and the renderer's parameters as it says. Throws `UNKNOWN_NAME`. */
  takePreset(viewer: Viewer, id: string): void {
    const preset = description().presets.find((known) => known.id === id);
    if (!preset) throw { code: 'UNKNOWN_NAME', message: `there is no preset ${id}` };
    const { values } = this.settings;
    this.takeTechnique(viewer, preset.technique);
    for (const key of [...values.keys()].filter((name) => name.startsWith('render.'))) {
      viewer.set(key, String(parameterOf(preset.technique, key)?.default));
      values.delete(key);
    }
    for (const [key, value] of Object.entries(preset.settings)) {
      viewer.set(key, value);
      values.set(key, value);
    }
  }

  /** The preset whose settings these are; undefined where something else is set, but for how the film is shown. */
  get preset(): string | undefined {
    const { technique, values } = this.settings;
    const own = [...values].filter(([key]) => !key.startsWith('film.'));
    const same = (settings: Record<string, string>) => own.length === Object.keys(settings).length && own.every(([key, value]) => settings[key] === value);
    return description().presets.find((preset) => preset.technique === technique && same(preset.settings))?.id;
  }

  /** Sets the film's and the renderer's parameters back to their defaults; a technique's are when it is chosen. */
  forgetValues(viewer: Viewer): void {
    const { technique, values } = this.settings;
    for (const key of values.keys()) if (key.includes('.')) viewer.set(key, String(parameterOf(technique, key)?.default));
  }

  /** Gives a renderer all that says how the picture is made, and keeps the values as the renderer writes them. */
  takeAll(viewer: Viewer): void {
    const { settings } = this;
    const standard = defaultSettings();
    this.attempt(`technique=${settings.technique}`, () => viewer.set_technique(settings.technique), () => {
      settings.technique = standard.technique;
      viewer.set_technique(standard.technique);
    });
    for (const [key, value] of [...settings.values]) {
      this.attempt(`${key}=${value}`, () => this.takeValue(viewer, key, value), () => settings.values.delete(key));
    }
    this.attempt(`view=${settings.view}`, () => viewer.set_view(settings.view), () => (settings.view = standard.view));
    viewer.set_seed(settings.seed);
  }

  /** Runs `work`; where it throws, says so and goes on with what `drop` puts in its place. */
  attempt(setting: string, work: () => void, drop: () => void): void {
    try {
      work();
    } catch (error) {
      this.refused({ ...toFailure(error), setting });
      drop();
    }
  }
}
