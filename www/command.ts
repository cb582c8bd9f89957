// The command line that renders the picture of the page.
import { poseText, type Settings } from './url-state.js';

/** A word of a shell's command line. */
const quoted = (word: string) => (/^[\w./:=,@%+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** The command line reads no addresses: the file itself, where it was saved. */
const fileName = (address: string) => address.slice(address.lastIndexOf('/') + 1);

/** `restir render ...` for these settings, at a moment, a size in pixels and so many frames; files are called by their names. */
export function commandLine(settings: Settings, sceneName: string, time: number, size: [number, number], frames: number): string {
  const { scene, environment, technique, seed, accumulate, lights, animation, camera, pose, values, view } = settings;
  const words = ['restir', 'render', scene === undefined || /[./]/.test(scene) ? fileName(scene ?? sceneName) : `builtin:${scene}`];
  const put = (name: string, value: string | number | undefined) => value !== undefined && words.push(`--${name}`, String(value));
  put('scene-index', settings.sceneIndex);
  put('variant', settings.variant);
  put('technique', technique);
  for (const [key, value] of values) put('set', `${key}=${value}`);
  put('size', size.join('x'));
  put('frames', Math.max(1, frames));
  put('seed', seed || undefined);
  put('environment', environment && (/^(sky|white)(:|$)/.test(environment) ? environment : fileName(environment)));
  put('lights', lights || undefined);
  put('time', time === 0 ? undefined : Number(time.toFixed(3)));
  put('animation', animation === '0' ? undefined : animation);
  if (pose) put('pose', poseText(pose));
  else put('camera', camera === '0' ? undefined : camera);
  put('view', view === 'radiance' ? undefined : view);
  put('accumulate', accumulate === undefined ? undefined : accumulate ? 'yes' : 'no');
  put('out', 'picture.png');
  return words.map(quoted).join(' ');
}
