// Where things are, and the environment in which every tool of this project runs.
import { existsSync, mkdirSync, readdirSync } from 'node:fs';
import { homedir } from 'node:os';
import { delimiter, join } from 'node:path';
import { fileURLToPath } from 'node:url';

/** The repository root. */
export const root = fileURLToPath(new URL('..', import.meta.url));

/** Pinned cargo-installed tools live here, so that no version the user has elsewhere is overwritten. */
export const toolsFolder = join(root, 'target', 'tools');

const cargoBin = join(process.env.CARGO_HOME ?? join(homedir(), '.cargo'), 'bin');

/** The user's environment with this project's own tools first on PATH. */
export const environment = {
  ...process.env,
  // Wherever the user builds, the build, its cache and its tools are below target/, where the scripts look for them.
  CARGO_TARGET_DIR: join(root, 'target'),
  PATH: [join(toolsFolder, 'bin'), join(root, 'node_modules', '.bin'), cargoBin, process.env.PATH].join(delimiter),
};

/** The manifest by which the Vulkan loader finds lavapipe, or undefined where it is not installed. */
export function lavapipeManifest() {
  const folder = '/usr/share/vulkan/icd.d';
  const name = existsSync(folder) ? readdirSync(folder).find((file) => file.startsWith('lvp_icd')) : undefined;
  return name && join(folder, name);
}

/** `environment`, with lavapipe as the only Vulkan driver: tests run on the same software adapter everywhere. */
export function softwareEnvironment() {
  const manifest = lavapipeManifest();
  const runtime = process.env.XDG_RUNTIME_DIR ?? join(root, 'target', 'runtime');
  mkdirSync(runtime, { recursive: true, mode: 0o700 });
  return { ...environment, VK_DRIVER_FILES: manifest, VK_ICD_FILENAMES: manifest, XDG_RUNTIME_DIR: runtime };
}
