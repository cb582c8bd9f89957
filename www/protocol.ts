// The messages between the page and the worker that reads scenes.
import type { Failure } from './api.js';

/** Where a scene comes from: a built-in by name, or a glTF file with the files that lie beside it. */
export type SceneSource =
  | { kind: 'builtin'; name: string }
  | { kind: 'file'; name: string; files: { name: string; bytes: Uint8Array }[] };

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

export type LoadResponse =
  | { kind: 'progress'; fraction: number; what: string }
  | { kind: 'scene'; flat: Uint8Array }
  | { kind: 'failure'; failure: Failure };
