// The messages between the page and the worker that reads scenes.
import type { Failure } from './api.js';
import type { Stage } from './stages.js';

/** What of a glTF file to show: a scene other than the default one, a material variant. */
export interface Choice {
  scene?: number;
  variant?: string;
}

/** Where a scene comes from: a built-in by name, a scene file with the files that lie beside it, or such a file's address. */
export type SceneSource =
  | { kind: 'builtin'; name: string }
  | { kind: 'file'; name: string; files: File[]; choice: Choice }
  | { kind: 'address'; name: string; address: string; choice: Choice };

/** What can be chosen in a glTF file. */
export interface Contents {
  scenes: string[];
  /** Index of the default scene. */
  scene: number;
  variants: string[];
}

/** What surrounds a scene instead of its own environment: `sky...` or `white`, or a map's bytes, or where to find them. */
export interface Surroundings {
  name: string;
  address?: string;
  bytes?: Uint8Array;
}

export interface LoadRequest {
  module: WebAssembly.Module;
  source: SceneSource;
  surroundings: Surroundings | undefined;
  /** Point lights to scatter in a scene that has no light. */
  lights: number;
  seed: number;
}

/** A scene as the worker made it. */
export interface Loaded {
  flat: Uint8Array;
  contents?: Contents;
}

export type LoadResponse =
  | { kind: 'progress'; stage: Stage; fraction: number; what: string }
  | ({ kind: 'scene' } & Loaded)
  | { kind: 'failure'; failure: Failure };
