// What determines a picture, and how a URL's query says it, so that a link is a picture. Keys of parameters are those of --set.
import type { Pose, Vector } from './api.js';
import { longestSide } from './resolution.js';

/** What a command line renders by default, too. */
export const defaultTechnique = 'restir-di';

/** All that determines a picture but the files of the user's. */
export interface Settings {
  /** A built-in scene's name, or a file's address; undefined for a file of the user's. */
  scene: string | undefined;
  /** Of a glTF file: index of the scene shown instead of the default one, and name of the variant. */
  sceneIndex: number | undefined;
  variant: string | undefined;
  /** What surrounds the scene: `sky...`, `white`, or the address of a map; undefined for its own, or a file of the user's. */
  environment: string | undefined;
  technique: string;
  view: string;
  seed: number;
  /** Whether frames are averaged; undefined leaves it to the scene (an animated one is not). */
  accumulate: boolean | undefined;
  /** Point lights to scatter in a scene that has none. */
  lights: number;
  /** Moment of the scene in seconds: where time stands still, or began to run. */
  time: number;
  /** How fast time runs. */
  speed: number;
  /** Index or name among the scene's animations. */
  animation: string;
  /** Index or name among the scene's cameras. */
  camera: string;
  /** Where the user has moved to, if they have. */
  pose: Pose | undefined;
  /** Render size in pixels; undefined follows the window. */
  size: [number, number] | undefined;
  /** Rendered pixels per device pixel, along one side; undefined adapts. */
  scale: number | undefined;
  /** Milliseconds that a frame may take where the scale adapts; undefined is 100. */
  budget: number | undefined;
  /** Accumulated frames after which to stop. */
  frames: number | undefined;
  /** Parameters that differ from their defaults. */
  values: Map<string, string>;
}

/** Moments are within so many seconds of 0, and time runs at most so many times as fast as a clock. */
export const [latest, fastest] = [1e9, 1e6] as const;

export const defaultSettings = (): Settings => ({
  scene: 'cornell',
  sceneIndex: undefined,
  variant: undefined,
  environment: undefined,
  technique: defaultTechnique,
  view: 'radiance',
  seed: 0,
  accumulate: undefined,
  lights: 0,
  time: 0,
  speed: 1,
  animation: '0',
  camera: '0',
  pose: undefined,
  size: undefined,
  scale: undefined,
  budget: undefined,
  frames: undefined,
  values: new Map(),
});

function integer(text: string, low: number, high: number): number {
  const value = Number(text);
  if (!/^\d+$/.test(text) || value < low || value > high) throw new Error(`must be a whole number from ${low} to ${high}`);
  return value;
}

function size(text: string): [number, number] {
  const found = /^(\d+)x(\d+)$/.exec(text);
  if (!found) throw new Error('must be WIDTHxHEIGHT in pixels');
  return [integer(found[1] ?? '', 1, longestSide), integer(found[2] ?? '', 1, longestSide)];
}

function scale(text: string): number {
  const value = Number(text);
  if (!(value >= 0.1 && value <= 2)) throw new Error('must be from 0.1 to 2');
  return value;
}

function budget(text: string): number {
  const value = Number(text);
  if (!(value >= 1 && value <= 10_000)) throw new Error('must be from 1 to 10000 milliseconds');
  return value;
}

function finite(text: string): number {
  const value = Number(text);
  if (text.trim() === '' || !Number.isFinite(value)) throw new Error('must be a number');
  return value;
}

function within(most: number, text: string): number {
  const value = finite(text);
  if (Math.abs(value) > most) throw new Error(`must be from ${-most} to ${most}`);
  return value;
}

/** A moment in seconds. Throws what is wrong with it. */
export function timeOf(text: string): number {
  return within(latest, text);
}

function accumulate(text: string): boolean {
  if (text !== 'yes' && text !== 'no') throw new Error('must be yes or no');
  return text === 'yes';
}

/** Nine numbers with commas between: position, forward, up. Throws what is wrong with them. */
export function poseOf(text: string): Pose {
  const numbers = text.split(',').map(Number);
  if (numbers.length !== 9 || !numbers.every(Number.isFinite)) throw new Error('must be nine numbers: position, forward, up');
  const vector = (at: number) => numbers.slice(at, at + 3) as Vector;
  return { position: vector(0), forward: vector(3), up: vector(6) };
}

/** What `poseOf` reads. */
export const poseText = ({ position, forward, up }: Pose) =>
  [...position, ...forward, ...up].map((value) => String(Number(value.toPrecision(5)))).join(',');

const readers: Record<string, (state: Settings, text: string) => void> = {
  scene: (state, text) => (state.scene = text),
  'scene-index': (state, text) => (state.sceneIndex = integer(text, 0, 0xffffffff)),
  variant: (state, text) => (state.variant = text),
  environment: (state, text) => (state.environment = text),
  technique: (state, text) => (state.technique = text),
  view: (state, text) => (state.view = text),
  seed: (state, text) => (state.seed = integer(text, 0, 0xffffffff)),
  accumulate: (state, text) => (state.accumulate = accumulate(text)),
  lights: (state, text) => (state.lights = integer(text, 0, 1_000_000)),
  time: (state, text) => (state.time = timeOf(text)),
  speed: (state, text) => (state.speed = within(fastest, text)),
  animation: (state, text) => (state.animation = text),
  camera: (state, text) => (state.camera = text),
  pose: (state, text) => (state.pose = poseOf(text)),
  size: (state, text) => (state.size = size(text)),
  scale: (state, text) => (state.scale = scale(text)),
  budget: (state, text) => (state.budget = budget(text)),
  frames: (state, text) => (state.frames = integer(text, 1, 0xffffffff)),
};

/** Whether a key is of all that is shown, not of one picture of two: not of its technique, view or parameters. */
export const isShared = (key: string) => Object.hasOwn(readers, key) && key !== 'technique' && key !== 'view';

/** A `name=value` that cannot be read, and why. */
export interface Unread {
  setting: string;
  message: string;
}

/** Reads a query. Keys that are none of the page's are taken for parameters. */
export function readQuery(query: string): { state: Settings; unread: Unread[] } {
  const state = defaultSettings();
  const unread: Unread[] = [];
  for (const [key, text] of new URLSearchParams(query)) {
    const read = Object.hasOwn(readers, key) ? readers[key] : undefined;
    try {
      if (read) read(state, text);
      else state.values.set(key, text);
    } catch (error) {
      unread.push({ setting: `${key}=${text}`, message: (error as Error).message });
    }
  }
  return { state, unread };
}

/** The query for `state`, with only what differs from the defaults; empty where nothing does. */
export function writeQuery(state: Settings): string {
  const defaults = defaultSettings();
  const query = new URLSearchParams();
  const put = (key: string, value: string | number | undefined, standard: string | number | undefined) => {
    if (value !== undefined && value !== standard) query.set(key, String(value));
  };
  put('scene', state.scene, defaults.scene);
  put('scene-index', state.sceneIndex, undefined);
  put('variant', state.variant, undefined);
  put('environment', state.environment, defaults.environment);
  put('technique', state.technique, defaults.technique);
  put('view', state.view, defaults.view);
  put('seed', state.seed, defaults.seed);
  put('accumulate', state.accumulate === undefined ? undefined : state.accumulate ? 'yes' : 'no', undefined);
  put('lights', state.lights, defaults.lights);
  put('time', Number(state.time.toFixed(3)), defaults.time);
  put('speed', state.speed, defaults.speed);
  put('animation', state.animation, defaults.animation);
  put('camera', state.camera, defaults.camera);
  put('pose', state.pose && poseText(state.pose), undefined);
  put('size', state.size?.join('x'), undefined);
  put('scale', state.scale, undefined);
  put('budget', state.budget, undefined);
  put('frames', state.frames, undefined);
  for (const [key, value] of state.values) query.set(key, value);
  // These need no escape in a query, and links are read by people.
  const text = query.toString().replace(/%2C|%3A|%3D|%2F/g, decodeURIComponent);
  return text && `?${text}`;
}
