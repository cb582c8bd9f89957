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
  /** What can be shown, and what it says; the first is the picture itself. */
  views: { name: string; meaning: string }[];
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

/** Bytes that are held now. */
export interface Memory {
  /** On the graphics device, for the scene: geometry, materials, textures, lights, environment. */
  scene: number;
  /** On the device, for the picture: what was averaged, what is displayed, first surfaces. */
  film: number;
  /** On the device, for the technique: its reservoirs. */
  technique: number;
  /** On the device, for the inspected pixel's notes; 0 while none is inspected. */
  inspector: number;
  /** WebAssembly's memory on the page's thread, of all viewers together. It never shrinks; a new scene uses again what is free in it. */
  wasm: number;
  /** JavaScript's heap, all of the page's, where the browser tells. */
  heap?: number;
}

/**
 * What `Viewer.stats()` resolves to: rays and passes of the last frame, `nan` and `inf` since the picture began, memory now. `heap` comes
 * from the page.
 */
export interface Stats {
  rays: number;
  nan: number;
  inf: number;
  passes: { name: string; ms: number }[];
  memory: Memory;
}

/** Distances of the picture from the reference, of linear radiance. */
export interface Errors {
  mse: number;
  /** Squared error over the squared reference plus 0.01. */
  relmse: number;
  /** Mean absolute error of luminance, a fraction; null where the reference is black. */
  mape: number | null;
  /** Signed difference of mean luminance, a fraction; null where the reference is black. */
  bias: number | null;
  /** Mean FLIP: 0 for equal pictures, at most 1 (Andersson et al. 2020). */
  flip: number;
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

/** What the colours of a view mean, as it is shown now. */
export interface ViewLegend {
  name: string;
  meaning: string;
  /** Of a view that shows a number: what is counted or measured. */
  unit?: string;
  /** The number that gets the first colour. */
  low?: number;
  /** The number that gets the last colour. */
  high?: number;
  /** Whether equal ratios, rather than differences, are equally far apart. */
  logarithmic?: boolean;
  /** CSS colours at even steps from the low end to the high one. */
  colors?: string[];
}

/** A setting that makes the expected picture differ from the truth, as it is now. */
export interface BiasNote {
  /** Its key. */
  parameter: string;
  /** How the picture differs. */
  why: string;
}

/** A light sample, as the inspected pixel sees it. */
export interface NotedSample {
  /** Index among the scene's lights. */
  light: number;
  /** Where on it: the same number, the same point. */
  point: number;
  light_kind: string;
  /** From the surface, world space. */
  direction: Vector;
  /** Metres; beyond every scene for what is infinitely far away. */
  distance: number;
  /** p-hat: luminance of the unshadowed integrand. */
  target_value: number;
}

/** What a pass saw: a candidate, a domain whose reservoir it joined, a neighbour that it rejected, or the reservoir that came out. */
export interface Note {
  kind: 'candidate' | 'domain' | 'rejected' | 'result';
  /** `initial`, `temporal`, `spatial 1`, ... */
  stage: string;
  /** Which of the pixel's reservoirs. */
  slot: number;
  sample: NotedSample | null;
  /** Of a domain: the pixel that its reservoir is from. */
  pixel: [number, number] | null;
  /** W. */
  unbiased_contribution_weight: number;
  /** c. */
  confidence_weight: number;
  /** m. */
  mis_weight: number;
  /** w. */
  resampling_weight: number;
  /** Of a result: whether its sample is lit at the pixel. */
  is_visible: boolean;
  /** Of a result that a pass left as it was: why. */
  reason: string;
}

/** One pixel of the last frame; radiance is linear Rec. 709. */
export interface Inspection {
  pixel: [number, number];
  surface: {
    instance: number;
    triangle: number;
    position: Vector;
    normal: Vector;
    depth: number;
    base_color: Vector;
    metallic: number;
    roughness: number;
    emission: Vector;
  } | null;
  /** Of the last frame. */
  radiance: Vector;
  /** Of the film. */
  mean: Vector;
  /** In the film's pixel. */
  samples: number;
  notes: Note[];
  /** Notes that there was no room for. */
  dropped: number;
}

/** A pass of a frame that was taken apart. */
export interface DissectedPass {
  /** `technique/pass`. */
  id: string;
  /** Its source, in shaders/. */
  file: string;
  /** What it wrote, or what that makes, as it would be displayed. */
  picture: ImageData | undefined;
}
