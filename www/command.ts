// The command line that renders the picture of the page.
import { poseText, type Settings } from './url-state.js';

/** A word of a shell's command line. */
const quoted = (word: string) => (/^[\w./:=,@%+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** `restir render ...` for these settings, at a size in pixels and so many frames; a file of the user's is called by its name. */
export function commandLine(settings: Settings, sceneName: string, size: [number, number], frames: number): string {
  const { scene, environment, technique, seed, accumulate, lights, time, animation, camera, pose, values } = settings;
  const address = scene?.includes('/') || scene?.startsWith('builtin:');
  const words = ['restir', 'render', scene === undefined ? sceneName : address ? scene : `builtin:${scene}`];
  const put = (name: string, value: string | number | undefined) => value !== undefined && words.push(`--${name}`, String(value));
  put('technique', technique);
  for (const [key, value] of values) put('set', `${key}=${value}`);
  put('size', size.join('x'));
  put('frames', Math.max(1, frames));
  put('seed', seed || undefined);
  put('environment', environment);
  put('lights', lights || undefined);
  put('time', time || undefined);
  put('animation', animation === '0' ? undefined : animation);
  if (pose) put('pose', poseText(pose));
  else put('camera', camera === '0' ? undefined : camera);
  put('accumulate', accumulate === undefined ? undefined : accumulate ? 'yes' : 'no');
  put('out', 'picture.png');
  return words.map(quoted).join(' ');
}
