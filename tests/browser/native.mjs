// The same picture from the command line, on lavapipe.
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { run } from '../../scripts/run.mjs';
import { softwareEnvironment } from '../../scripts/environment.mjs';
import { decodePng } from './png.mjs';

/** Renders with `restir render SCENE` and the given options; returns width, height and rgb. */
export async function renderNatively(scene, options) {
  const folder = mkdtempSync(join(tmpdir(), 'restir-native-'));
  const file = join(folder, 'picture.png');
  try {
    await run(['cargo', 'run', '--quiet', '--', 'render', scene, ...options, '--out', file], { env: softwareEnvironment() });
    return decodePng(readFileSync(file));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** The file that `restir cook SCENE` writes. */
export async function cook(scene) {
  const folder = mkdtempSync(join(tmpdir(), 'restir-native-'));
  const file = join(folder, 'scene.restir');
  try {
    await run(['cargo', 'run', '--quiet', '--', 'cook', scene, '--out', file], { env: softwareEnvironment() });
    return readFileSync(file);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** What `restir compare` says of two pictures that `restir render SCENE` makes with the given options. */
export async function compareNatively(scene, options, reference) {
  const folder = mkdtempSync(join(tmpdir(), 'restir-native-'));
  const env = softwareEnvironment();
  try {
    const files = [];
    for (const [name, words] of [['picture.exr', options], ['reference.exr', reference]]) {
      files.push(join(folder, name));
      await run(['cargo', 'run', '--quiet', '--', 'render', scene, ...words, '--out', files.at(-1)], { env });
    }
    return JSON.parse(await run(['cargo', 'run', '--quiet', '--', 'compare', ...files, '--json'], { env }));
  } finally {
    rmSync(folder, { recursive: true });
  }
}
