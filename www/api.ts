// The shape of the JSON that the wasm module hands over. Its source is the parameter declarations in Rust.

/** One declared parameter of a technique, the film or the renderer. */
export interface Parameter {
  name: string;
  /** What it is, and what a higher and a lower value do. */
  doc: string;
  kind: 'u32' | 'f32' | 'bool' | 'choice';
  default: number | boolean | string;
  min?: number;
  max?: number;
  unit?: string;
  choices?: string[];
}

/** One technique, and what can be set in it. */
export interface TechniqueInfo {
  id: string;
  title: string;
  summary: string;
  papers: string[];
  /** False where its expected picture differs from the reference; `bias` says how. */
  unbiased: boolean;
  bias: string;
  /** Names of what can be shown; the first is the picture itself. */
  views: string[];
  params: Parameter[];
}

/** One built-in scene. */
export interface SceneInfo {
  name: string;
  title: string;
  doc: string;
  /** A name that can be loaded: `name` with its number filled in, where it takes one. */
  example: string;
}

/** Settings that go by a name: those of a paper. */
export interface Preset {
  id: string;
  title: string;
  /** What it stands for, and what it leaves out. */
  doc: string;
  technique: string;
  /** Values by key; all others are at their defaults. */
  settings: Record<string, string>;
}

/** What `describe()` returns. */
export interface Description {
  version: string;
  techniques: TechniqueInfo[];
  film: { params: Parameter[] };
  render: { params: Parameter[] };
  presets: Preset[];
  scenes: SceneInfo[];
}

/** x, y, z. */
export type Vector = [number, number, number];

/** A camera as the module gives and takes it. Perspective has `vertical_fov` (radians), orthographic `half_height`. */
export interface Camera {
  name?: string;
  position: Vector;
  forward: Vector;
  up: Vector;
  vertical_fov?: number;
  half_height?: number;
}

/** Where a camera is and where it looks, in the scene's units; the directions need not be of length 1. */
export type Pose = Pick<Camera, 'position' | 'forward' | 'up'>;

/** What `Viewer.stats()` resolves to: rays and passes of the last frame, `nan` and `inf` since the picture began. */
export interface Stats {
  rays: number;
  nan: number;
  inf: number;
  passes: { name: string; ms: number }[];
}

/** What `Viewer.errors()` resolves to: distances of the picture from the reference, of linear radiance. */
export interface Errors {
  mse: number;
  /** Squared error over the squared reference plus 0.01. */
  relmse: number;
  /** Mean absolute error of luminance, a fraction; null where the reference is black. */
  mape: number | null;
  /** Signed difference of mean luminance, a fraction; null where the reference is black. */
  bias: number | null;
}

/** What `Viewer.info()` returns: what the renderer has, and what was left out or repaired while the scene was read. */
export interface SceneReport {
  warnings: string[];
  /** Whether something moves; then frames are not averaged unless asked for. */
  animated: boolean;
  /** Animations to choose from, each a loop of so many seconds. */
  animations: { name: string; seconds: number }[];
  /** Seconds after which the first animation starts again. */
  seconds: number;
  /** Indices of cameras that move. */
  moving_cameras: number[];
  /** Name of the graphics adapter. */
  adapter: string;
}

/** What the wasm module throws; `code` is that of `Error::code` in Rust. */
export interface Failure {
  code: string;
  message: string;
}
