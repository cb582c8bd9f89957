// What a viewer shows and tells: its events, what comes with them, and what a scene opens with.
import type { Camera, Failure, Pose, SceneReport } from './api.js';
import type { Choice, Contents, SceneSource, Surroundings } from './protocol.js';
import type { Stage } from './stages.js';

/** One frame. */
export interface Sample {
  /** Frames in the picture: 1 where they are not averaged. */
  count: number;
  /** From the frame's first command to an idle device. */
  milliseconds: number;
  /** Rendered pixels. */
  width: number;
  height: number;
  /** Moment of the scene, in seconds. */
  time: number;
  /** Whether the picture has all the frames it shall have. */
  complete: boolean;
}

/** What went wrong. The last good picture stays on the canvas. */
export interface ViewerFailure extends Failure {
  /** `name=value` of one of many settings given at once, to the constructor or `show`, that was not taken; its default is used instead. `picture B: ` stands before one of a comparison's second picture. */
  setting?: string;
  /** The renderer has stopped: after `INTERNAL` only loading the page again helps, else `restore()` may. */
  stopped?: boolean;
}

/** What is shown. */
export interface Scene {
  source: SceneSource;
  surroundings: Surroundings | undefined;
  report: SceneReport;
  cameras: Camera[];
  /** Scenes and variants to choose from in a glTF file. */
  contents: Contents;
}

/** A value that has changed: of a parameter by its key, or of one of `Settings` by its name. */
export interface Change {
  name: string;
  value: string | number | boolean | undefined;
}

export interface ViewerEventMap {
  /**
   * Which stage a load is in, how far it is as a whole, from 0 to 1, and what it does; at 1 the renderer takes it over, and it cannot be
   * cancelled any more. `count` tells how many of how many pipelines are compiled. The last stages, `pipelines` and `picture`, end with the
   * first `sample` after `load`.
   */
  progress: CustomEvent<{ stage: Stage; fraction: number; what: string; count?: [done: number, all: number] }>;
  /** A scene is there; its first picture is about to be rendered. */
  load: CustomEvent<Scene>;
  /** After each frame. */
  sample: CustomEvent<Sample>;
  /** The camera was moved, by hand or by `setCamera`. */
  'camera-change': CustomEvent<Camera>;
  /** Something else that determines the picture was changed. */
  'param-change': CustomEvent<Change>;
  /** Something went wrong; the method's promise is rejected, too. */
  error: CustomEvent<ViewerFailure>;
  /** The graphics device was lost. Unless `final`, the viewer is about to build everything again. */
  devicelost: CustomEvent<{ message: string; final: boolean }>;
  /** The viewer renders again, on another device. */
  restored: CustomEvent<null>;
}

/** What a scene opens with. What is left out is the scene's own; `environment` is kept as it is. */
export interface LoadOptions {
  /** What of a glTF file to show. */
  choice?: Choice;
  /** Index or name among the scene's animations. */
  animation?: string;
  /** `sky...`, `white`, or the address of an .hdr or .exr map; null for the scene's own. */
  environment?: string | null | undefined;
  /** Index or name among the scene's cameras. */
  camera?: string;
  pose?: Pose;
  /** Seconds. */
  time?: number;
}
