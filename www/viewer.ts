// A scene on a canvas: loads it, renders it, moves its camera, and starts again when the device is lost. Knows no page.
import { findAdapter } from './adapter.js';
import type { BiasNote, Camera, Description, DissectedPass, Errors, Failure, Inspection, Memory, Pose, SceneReport, Stats, ViewLegend } from './api.js';
import { Controls } from './controls.js';
import { description, parameterOf } from './description.js';
import { sharedDevice } from './device.js';
import { Fade } from './fade.js';
import { readDropped, sourceOf, surroundingsOf } from './files.js';
import { type Progress, SceneLoader } from './loader.js';
import { type Picture, errorsOf } from './measure.js';
import { RestirError, toFailure } from './messages.js';
import { pixelAt } from './overlay.js';
import { pngOf, readChannels, readDisplay } from './pictures.js';
import { Viewer } from './pkg/restir.js';
import type { Choice, Contents, SceneSource, Surroundings } from './protocol.js';
import { RenderLoop, renderFrame } from './render-loop.js';
import { Resolution, defaultBudget, longestSide } from './resolution.js';
import { SceneCamera } from './scene-camera.js';
import { SettingsTaker } from './settings-taker.js';
import { type Settings, defaultSettings, fastest, latest, writeQuery } from './url-state.js';
import type { Change, LoadOptions, Scene, ViewerEventMap } from './viewer-events.js';
import { compileWasm, startWasm } from './wasm.js';

export type { BiasNote, Camera, Choice, Contents, Description, DissectedPass, Errors, Failure, Inspection, Memory, Picture, Pose, SceneReport, Settings, Stats };
export type { Stage } from './stages.js';
export type * from './viewer-events.js';
export { RestirError };

export interface RestirViewer {
  addEventListener<Type extends keyof ViewerEventMap>(
    type: Type,
    listener: (event: ViewerEventMap[Type]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/** How a scene is seen when it opens; with `values`, all settings. */
type View = Partial<Settings>;

const noContents: Contents = { scenes: [], scene: 0, variants: [] };
/** So many losses within so many milliseconds, and the viewer gives up. */
const [mostLosses, lossesWithin] = [2, 30_000];

const disposed = () => new RestirError({ code: 'DISPOSED', message: 'The viewer has been disposed.' });
const invalid = (message: string) => new RestirError({ code: 'BAD_VALUE', message });

function checkRange(name: string, value: number, low: number, high: number, whole = false): void {
  if (value >= low && value <= high && (!whole || Number.isInteger(value))) return;
  throw invalid(`${name} must be a ${whole ? 'whole ' : ''}number from ${low} to ${high}.`);
}

/**
 * Renders a scene to a canvas, as large as the canvas is shown. Nothing is fetched before the first `load`.
 *
 * Methods that change the picture take effect between two frames, and wait for the first scene where there is none yet. Each
 * failure of theirs is one `error` event, and rejects the method's promise with a `RestirError`; that need not be caught. Methods that only
 * read reject without an event.
 */
export class RestirViewer extends EventTarget {
  /** What determines the picture: to be read, and changed by the methods. */
  readonly settings: Settings;
  private readonly loader = new SceneLoader();
  private readonly taker: SettingsTaker;
  private readonly sceneCamera: SceneCamera;
  private readonly resolution: Resolution;
  private readonly fade: Fade;
  private readonly loop = new RenderLoop({
    beforeFrame: (viewer, seconds) => this.beforeFrame(viewer, seconds),
    making: (made, all) => this.making(made, all),
    afterFrame: (viewer, milliseconds) => this.afterFrame(viewer, milliseconds),
    failed: (error) => this.failed(error),
  });
  private input: { controls: Controls; end: AbortController } | undefined;
  private viewer: Viewer | undefined;
  private shown: Scene | undefined;
  /** What is being loaded: what is asked for meanwhile starts from it. */
  private wanted: { source: SceneSource; surroundings: Surroundings | undefined; view: View | undefined } | undefined;
  /** The scene as the worker made it: a lost device is rebuilt from it. */
  private flat: Uint8Array | undefined;
  private started: Promise<void> | undefined;
  /** Scenes are shown, and renderers made, one after another. */
  private turn: Promise<unknown> = Promise.resolve();
  private rendered: [number, number] = [0, 0];
  /** Of the last frame. */
  private moment = 0;
  private shownView = 'radiance';
  /** When devices were lost. */
  private losses: number[] = [];
  private halted = false;
  private kept: Picture | undefined;
  private inspected: [number, number] | undefined;
  /** Whether what was loaded waits for its first picture. */
  private fresh = false;
  private ended = false;

  /** `settings` are those of the first scene; what it does not take is reported and dropped. `scene` is ignored: see `load`. */
  constructor(private readonly canvas: HTMLCanvasElement, settings: Partial<Settings> = {}) {
    super();
    this.settings = { ...defaultSettings(), ...settings, values: new Map(settings.values) };
    this.taker = new SettingsTaker(this.settings, (failure) => this.emit('error', failure));
    this.sceneCamera = new SceneCamera(this.settings, () => this.shown);
    this.resolution = new Resolution(canvas);
    this.fade = new Fade(canvas);
    this.takeLimits();
  }

  /** All techniques, parameters and built-in scenes. */
  static async describe(): Promise<Description> {
    await startWasm();
    return description();
  }

  // Scenes

  /**
   * Shows a scene: `builtin:cornell`, `cornell`, or the address of a .glb, .gltf, .obj or .restir file. A load still running is
   * abandoned: it rejects with `CANCELLED`. Rejects with `IO`, `BAD_FILE`, `UNSUPPORTED`, `UNKNOWN_NAME`, `LIMIT`, `NO_WEBGPU`, ...
   */
  load(scene: string, { environment, choice, ...view }: LoadOptions = {}): Promise<void> {
    const given = Object.fromEntries(Object.entries(view).filter(([, value]) => value !== undefined)) as View;
    return this.reported(async () => {
      if (given.time !== undefined) checkRange('time', given.time, -latest, latest);
      const source = sourceOf(scene);
      if (choice && source.kind !== 'builtin') source.choice = choice;
      await this.open(source, this.surroundingsFor(environment), given);
    });
  }

  /** Shows files that were picked or dropped: a scene, an environment map, or both. Rejects also with `NOT_A_SCENE`. */
  loadFiles(files: readonly File[]): Promise<void> {
    return this.reported(async () => {
      const { source, surroundings = this.surroundingsFor(undefined) } = await readDropped(files);
      await this.open(source ?? this.source(), surroundings, source ? {} : this.wanted?.view);
    });
  }

  /** Surrounds the scene by `sky...`, `white` or the map at an address; null gives it back its own environment. */
  setEnvironment(environment: string | null): Promise<void> {
    return this.reported(async () => this.open(this.source(), this.surroundingsFor(environment), this.wanted?.view));
  }

  /** Shows another scene or variant of the file that is shown; does nothing for a built-in scene. */
  choose(choice: Choice): Promise<void> {
    return this.reported(async () => {
      const source = this.source();
      if (source.kind === 'builtin') return;
      const view = choice.scene === undefined ? this.wanted?.view : {};
      await this.open({ ...source, choice: { ...source.choice, ...choice } }, this.surroundingsFor(undefined), view);
    });
  }

  /**
   * Shows the picture of all these settings, as a link to it would; a scene is loaded only where another one is shown. `files` are
   * those of a former `scene`, for a picture of files of the user's. What is not taken is reported, and its default used instead.
   */
  show(settings: Settings, files?: Pick<Scene, 'source' | 'surroundings'>): Promise<void> {
    return this.reported(async () => {
      // What is loaded only now is not wanted any more.
      const settled = this.loader.busy || !this.wanted;
      this.loader.cancel();
      const all = { ...settings, values: new Map(settings.values) };
      const before = JSON.stringify(this.camera());
      if (settled && this.isOf(settings, files)) {
        await this.loop.change((viewer) => {
          this.taker.forgetValues(viewer);
          Object.assign(this.settings, all);
          this.takeSettings(viewer);
          this.takeView(viewer);
        });
      } else {
        const { scene, sceneIndex, variant, environment } = settings;
        const source = files?.source ?? sourceOf(scene ?? '');
        const choice = { ...(sceneIndex !== undefined && { scene: sceneIndex }), ...(variant !== undefined && { variant }) };
        if (!files && source.kind !== 'builtin') source.choice = choice;
        await this.open(source, files ? files.surroundings : this.surroundingsFor(environment ?? null), all);
      }
      if (JSON.stringify(this.camera()) !== before) this.emit('camera-change', this.camera());
      this.emit('param-change', { name: 'settings', value: undefined });
    });
  }

  /** Shows what another viewer shows, from the same bytes: its scene, from where it is seen, at its moment. */
  showAs(other: RestirViewer): Promise<void> {
    return this.reported(async () => {
      const { shown, flat } = other;
      if (!shown || !flat) throw invalid('There is no scene yet.');
      const { camera, pose, animation, time } = other.settings;
      await this.start();
      await this.present(flat, shown, { camera, time: other.accumulating ? time : other.moment, animation, ...(pose && { pose }) });
      if (this.shown) this.emit('load', this.shown);
    });
  }

  /** Abandons the load that is running, if one is. */
  cancel(): void {
    this.loader.cancel();
  }

  /** Whether a load is running. */
  get loading(): boolean {
    return this.loader.busy;
  }

  /** Whether a scene is being loaded or taken over by the renderer: until its `load` event. */
  get opening(): boolean {
    return this.wanted !== undefined;
  }

  /** What is shown; undefined before the first `load` event. */
  get scene(): Scene | undefined {
    return this.shown;
  }

  // Settings

  /** Switches to another technique, with its own defaults; the renderer's and film's parameters stay. Rejects with `UNKNOWN_NAME`. */
  setTechnique(id: string): Promise<void> {
    return this.set('technique', id, (viewer) => this.taker.takeTechnique(viewer, id));
  }

  /** Switches to a preset: its technique, and the renderer's parameters as it says; the film's stay. Rejects with `UNKNOWN_NAME`. */
  setPreset(id: string): Promise<void> {
    return this.set('preset', id, (viewer) => {
      this.taker.takePreset(viewer, id);
      viewer.set_accumulate(this.accumulating);
    });
  }

  /** The preset whose settings these are; undefined where something else is set, but for how the film is shown. */
  get preset(): string | undefined {
    return this.taker.preset;
  }

  /**
   * Sets the parameter `name`, `render.name` or `film.name`; undefined sets its default. Rejects with `UNKNOWN_NAME` or `BAD_VALUE`.
   */
  setParam(name: string, value: string | number | boolean | undefined): Promise<void> {
    const work = (viewer: Viewer) => {
      const parameter = parameterOf(this.settings.technique, name);
      if (value === undefined && !parameter) return void this.settings.values.delete(name);
      this.taker.takeValue(viewer, name, String(value ?? parameter?.default));
      // Whether time runs may hang on it: an environment that turns moves.
      if (name.startsWith('render.')) viewer.set_accumulate(this.accumulating);
    };
    return this.set(name, value, work, name.startsWith('film.'));
  }

  /** Shows a debug view of the technique, or `radiance`. Rejects with `UNKNOWN_NAME`. */
  setView(name: string): Promise<void> {
    return this.set('view', name, (viewer) => {
      viewer.set_view(name);
      this.settings.view = name;
    });
  }

  /** Sets the seed of all random numbers, 0 to 4294967295. */
  setSeed(seed: number): Promise<void> {
    return this.set('seed', seed, (viewer) => {
      checkRange('seed', seed, 0, 0xffffffff, true);
      viewer.set_seed(seed);
      this.settings.seed = seed;
    });
  }

  /**
   * Goes to one of the scene's cameras, by index or name, or to where a pose says; `moving` on the way, where frames shall come in time
   * rather than sharp. Rejects with `UNKNOWN_NAME` or `BAD_VALUE`.
   */
  setCamera(camera: string | number | Pose, { moving = false } = {}): Promise<void> {
    return this.reported(() =>
      this.loop.change((viewer) => {
        if (moving) this.resolution.move();
        if (typeof camera === 'object') this.sceneCamera.setPose(viewer, camera);
        else this.sceneCamera.follow(viewer, String(camera));
        this.emit('camera-change', this.camera());
      }),
    );
  }

  /** Turns the camera to what the pixel (x, y) from the top left shows, which it orbits from then on. Does nothing where there is no surface. */
  focus(x: number, y: number): Promise<void> {
    return this.reported(() =>
      this.loop.change(async (viewer) => {
        viewer.inspect(Uint32Array.of(x, y));
        await renderFrame(viewer);
        const { surface } = JSON.parse((await viewer.inspection()) as string) as Inspection;
        viewer.inspect(Uint32Array.from(this.isInside(this.inspected) ? this.inspected : []));
        if (!surface) return;
        this.sceneCamera.orbit.focus(surface.position);
        this.emit('camera-change', this.sceneCamera.applyOrbit(viewer));
      }),
    );
  }

  /** The camera of the picture. */
  camera(): Camera {
    return this.sceneCamera.orbit.toCamera();
  }

  /** Index of the scene's camera that was chosen last. */
  get cameraIndex(): number {
    return this.sceneCamera.index;
  }

  /** Goes to a moment of the scene, in seconds. */
  setTime(seconds: number): Promise<void> {
    return this.set('time', seconds, (viewer) => {
      checkRange('time', seconds, -latest, latest);
      viewer.set_time(seconds);
      this.settings.time = seconds;
    });
  }

  /** How many times as fast the scene's time runs. */
  setSpeed(speed: number): Promise<void> {
    return this.set('speed', speed, (viewer) => {
      checkRange('speed', speed, -fastest, fastest);
      viewer.set_speed(speed);
      this.settings.speed = speed;
    });
  }

  /** Plays another of the scene's animations, by index or name. Rejects with `UNKNOWN_NAME`. */
  setAnimation(animation: string): Promise<void> {
    return this.set('animation', animation, (viewer) => {
      viewer.set_animation(animation);
      this.settings.animation = animation;
    });
  }

  /** Whether frames are averaged while time stands still, or time runs; undefined leaves it to the scene: one that moves runs. */
  setAccumulate(on: boolean | undefined): Promise<void> {
    return this.set('accumulate', on, (viewer) => {
      this.settings.accumulate = on;
      viewer.set_accumulate(this.accumulating);
      // A link shows the moment at which time was stopped.
      this.settings.time = viewer.time();
      if (this.accumulating) viewer.set_time(viewer.time());
    });
  }

  /** Whether frames are averaged. */
  get accumulating(): boolean {
    return this.settings.accumulate ?? !this.moves;
  }

  /** Whether the scene looks otherwise at another moment. */
  get moves(): boolean {
    const turns = Number(this.settings.values.get('render.environment_rotation_rate') ?? 0) !== 0;
    return turns || (this.shown?.report.animated ?? false);
  }

  /** Rendered pixels per device pixel along one side, 0.1 to 2; undefined adapts to the time that frames take. */
  setScale(scale: number | undefined): Promise<void> {
    return this.reported(async () => {
      if (scale !== undefined) checkRange('scale', scale, 0.1, 2);
      this.settings.scale = this.resolution.fixedScale = scale;
      this.emit('param-change', { name: 'scale', value: scale });
    });
  }

  /** Milliseconds, 1 to 10000, that a frame may take where the scale adapts; undefined is 100. */
  setBudget(milliseconds: number | undefined): Promise<void> {
    return this.reported(async () => {
      if (milliseconds !== undefined) checkRange('budget', milliseconds, 1, 10_000);
      this.settings.budget = milliseconds;
      this.resolution.budget = milliseconds ?? defaultBudget;
      this.emit('param-change', { name: 'budget', value: milliseconds });
    });
  }

  /** Renders so many pixels wide and high, 1 to 8192 each; undefined follows the canvas. */
  setSize(size: [number, number] | undefined): Promise<void> {
    return this.reported(async () => {
      for (const side of size ?? []) checkRange('size', side, 1, longestSide, true);
      this.settings.size = this.resolution.fixedSize = size;
      this.emit('param-change', { name: 'size', value: size?.join('x') });
    });
  }

  /** While true only `renderAt` renders, and what would change the size or move the camera waits. */
  hold(on: boolean): void {
    this.loop.held = on;
  }

  /** Stops after so many averaged frames, until something changes; undefined goes on. */
  setMaxSamples(frames: number | undefined): Promise<void> {
    return this.reported(async () => {
      if (frames !== undefined) checkRange('max-samples', frames, 1, 0xffffffff, true);
      this.settings.frames = frames;
      this.loop.frameLimit = frames ?? Infinity;
      this.emit('param-change', { name: 'frames', value: frames });
    });
  }

  /** What mouse, keys and touch on the canvas do; nothing by default. */
  get controls(): 'none' | 'orbit' | 'fly' {
    return this.input?.controls.mode ?? 'none';
  }

  set controls(mode: 'none' | 'orbit' | 'fly') {
    if (mode === 'none') {
      this.input?.end.abort();
      this.input = undefined;
      return;
    }
    if (!this.input) {
      const end = new AbortController();
      this.input = { controls: new Controls(this.canvas, this.sceneCamera.orbit, end.signal), end };
      const focus = ({ clientX, clientY }: MouseEvent) => {
        const pixel = pixelAt(this.canvas, this.rendered, clientX, clientY);
        if (pixel) void this.focus(...pixel);
      };
      this.canvas.addEventListener('dblclick', focus, { signal: end.signal });
    }
    this.input.controls.mode = mode;
  }

  // Rendering

  /** Stops rendering; the picture stays. */
  pause(): void {
    this.loop.paused = true;
  }

  /** Goes on rendering. */
  play(): void {
    this.loop.paused = false;
  }

  /** Whether it was stopped by `pause` or `step`. */
  get paused(): boolean {
    return this.loop.paused;
  }

  /** Pauses, and renders one more frame. */
  step(): void {
    this.pause();
    this.loop.step();
  }

  /** Renders one frame more, also of a picture that is paused or complete. */
  renderFrame(): void {
    this.loop.step();
  }

  /** Whether the renderer has stopped after a failure: see `restore`. */
  get stopped(): boolean {
    return this.halted;
  }

  /** While true nothing is rendered, because nobody sees it. A hidden tab does that by itself. */
  get suspended(): boolean {
    return this.loop.suspended;
  }

  set suspended(on: boolean) {
    this.loop.suspended = on;
  }

  /** Starts the picture again. */
  reset(): Promise<void> {
    return this.reported(() => this.loop.change((viewer) => viewer.reset()));
  }

  // What is there

  /**
   * The picture as shown: a PNG file, or `ImageData` of sRGB bytes, row-major from the top. Or, as `exr`, an OpenEXR file with what
   * was averaged, linear Rec. 709 radiance, and albedo, normal, depth and motion of what the pixels of the last frame see first, as
   * `restir render` writes it.
   */
  capture(options: { type: 'rgba' }): Promise<ImageData>;
  capture(options?: { type: 'png' | 'exr' }): Promise<Blob>;
  capture({ type = 'png' }: { type?: 'png' | 'rgba' | 'exr' } = {}): Promise<ImageData | Blob> {
    return this.reported(async () => {
      if (type === 'exr') return this.exr();
      if (type !== 'png' && type !== 'rgba') throw invalid(`${String(type)} is none of png, rgba, exr.`);
      const picture = await this.picture();
      return type === 'rgba' ? picture : pngOf(picture);
    });
  }

  /** Draws what is shown on a 2-D canvas, as large as that is. */
  drawOn(context: CanvasRenderingContext2D): Promise<void> {
    return this.call((viewer) => {
      // Once more, for only what was presented in the same task can be read.
      viewer.present();
      context.drawImage(this.canvas, 0, 0, context.canvas.width, context.canvas.height);
    });
  }

  /**
   * Renders a moment of the scene, in seconds, with so many averaged frames, as a link to it would; then the picture goes on as before. What it
   * resolves to is what `capture` says of the types. Rejects with `CANCELLED` by `signal`, or where another scene is asked for.
   */
  renderAt(seconds: number, frames: number, options: { type: 'rgba'; signal?: AbortSignal }): Promise<ImageData>;
  renderAt(seconds: number, frames: number, options?: { type?: 'png'; signal?: AbortSignal }): Promise<Blob>;
  renderAt(seconds: number, frames: number, { type = 'png', signal }: { type?: 'png' | 'rgba'; signal?: AbortSignal } = {}): Promise<ImageData | Blob> {
    return this.reported(async () => {
      checkRange('time', seconds, -latest, latest);
      checkRange('frames', frames, 1, 0xffffffff, true);
      const goOn = () => {
        if (signal?.aborted) throw { code: 'CANCELLED', message: 'Cancelled.' };
        if (this.opening) throw { code: 'CANCELLED', message: 'Another scene was chosen.' };
      };
      const picture = await this.call(async (viewer) => {
        goOn();
        const before = viewer.time();
        viewer.set_accumulate(true);
        viewer.set_time(seconds);
        viewer.reset();
        try {
          for (let frame = 0; frame < frames; frame++) {
            await renderFrame(viewer);
            goOn();
          }
          return await this.read(viewer);
        } finally {
          viewer.set_accumulate(this.accumulating);
          viewer.set_time(before);
          viewer.reset();
          this.loop.step();
        }
      });
      return type === 'rgba' ? picture : pngOf(picture);
    });
  }

  /** Rendered pixels, wide and high. */
  get size(): [number, number] {
    return [...this.rendered];
  }

  /** Red, green, blue and alpha, 0 to 255, of the rendered pixel at (x, y) from the top left. Rejects with `BAD_VALUE` outside. */
  readPixel(x: number, y: number): Promise<[number, number, number, number]> {
    return this.reported(async () => {
      const { data, width, height } = await this.picture();
      checkRange('x', x, 0, width - 1, true);
      checkRange('y', y, 0, height - 1, true);
      const at = 4 * (y * width + x);
      return [...data.subarray(at, at + 4)] as [number, number, number, number];
    });
  }

  /**
   * The address at which `page`, by default the one that restir comes with, shows the same picture. The files of the user's are
   * not in it.
   */
  shareUrl(page: string | URL = import.meta.url.replace(/[^/]*$/, '')): string {
    const url = new URL(page, document.baseURI);
    url.search = writeQuery(this.settings);
    return url.href;
  }

  /** Rays and milliseconds of each pass in the last frame, and memory in bytes. Passes are empty where the device has no timestamps. */
  timings(): Promise<Stats> {
    return this.call(async (viewer) => {
      const stats = JSON.parse((await viewer.stats()) as string) as Stats;
      // Not of the standard: Chromium tells.
      const { memory } = performance as Performance & { memory?: { usedJSHeapSize: number } };
      return memory ? { ...stats, memory: { ...stats.memory, heap: memory.usedJSHeapSize } } : stats;
    });
  }

  /** The averaged picture as it is now. */
  readPicture(): Promise<Picture> {
    return this.call(async (viewer) => {
      const [width, height] = this.rendered;
      return { view: this.shownView, time: this.moment, width, height, pixels: (await viewer.read_picture()) as Float32Array };
    });
  }

  /** Keeps the averaged picture as `reference`, and its size in pixels from now on, for only alike ones are compared. */
  keepReference(): Promise<void> {
    return this.reported(async () => {
      this.kept = undefined;
      this.kept = await this.readPicture();
      const { width, height } = this.kept;
      await this.setSize([width, height]);
    });
  }

  /** What `keepReference` kept last. */
  get reference(): Picture | undefined {
    return this.kept;
  }

  /** Lets go of it, as of one that shows something else. */
  forgetReference(): void {
    this.kept = undefined;
  }

  /** How far the picture is from a reference. Rejects with `BAD_VALUE` where there is none, or one of another size or view. */
  async errors(reference = this.kept): Promise<Errors> {
    if (!reference) throw invalid('There is no reference yet.');
    const picture = await this.readPicture();
    return errorsOf(picture, reference).catch((thrown: unknown) => {
      throw new RestirError(toFailure(thrown));
    });
  }

  /** Which settings, as they are now, bias the picture. */
  biases(): Promise<BiasNote[]> {
    return this.call((viewer) => JSON.parse(viewer.biases()) as BiasNote[]);
  }

  /** What the colours of the view mean, in the range that is set. */
  legend(): Promise<ViewLegend> {
    return this.call((viewer) => JSON.parse(viewer.legend()) as ViewLegend);
  }

  /** Has the passes of frames from now on observed at the pixel (x, y) from the top left; undefined ends it. Rejects with `BAD_VALUE` outside. */
  inspect(pixel: [number, number] | undefined): Promise<void> {
    return this.reported(() =>
      this.call((viewer) => {
        viewer.inspect(Uint32Array.from(pixel ?? []));
        this.inspected = pixel;
      }),
    );
  }

  /** What was seen at that pixel in the last frame. */
  inspection(): Promise<Inspection> {
    return this.call(async (viewer) => JSON.parse((await viewer.inspection()) as string) as Inspection);
  }

  /** Renders the next frame, even while paused, and resolves to what each of its passes wrote. */
  dissect(): Promise<DissectedPass[]> {
    return this.reported(() =>
      this.loop.dissect(async (viewer) => {
        const [width, height] = this.rendered;
        const passes = JSON.parse(viewer.dissection()) as { id: string; file: string; has_picture: boolean }[];
        const dissected: DissectedPass[] = [];
        try {
          for (const [index, { id, file, has_picture: hasPicture }] of passes.entries()) {
            const bytes = hasPicture ? ((await viewer.dissected(index)) as Uint8Array) : undefined;
            dissected.push({ id, file, picture: bytes && new ImageData(Uint8ClampedArray.from(bytes), width, height) });
          }
        } finally {
          viewer.forget_dissection();
        }
        return dissected;
      }),
    );
  }

  /** Runs work on the wasm module's own viewer between two frames; for what has no method here. */
  async call<T>(work: (viewer: Viewer) => T | Promise<T>): Promise<T> {
    try {
      return await this.loop.call(work);
    } catch (thrown) {
      throw new RestirError(toFailure(thrown));
    }
  }

  // Beginning and end

  /** Once the renderer has stopped: makes it anew from the scene that was shown. The viewer does so by itself unless devices are lost again and again. */
  restore(): Promise<void> {
    return this.reported(async () => void (this.halted && (await this.rebuild())));
  }

  /** Ends everything and frees the memory. What waits, and what is called later, rejects with `DISPOSED`. */
  dispose(): void {
    if (this.ended) return;
    this.ended = true;
    this.controls = 'none';
    this.loader.cancel();
    this.flat = undefined;
    this.fade.end();
    void this.loop.end(disposed()).then(() => this.inTurn(async () => this.freeViewer()));
  }

  private emit<Type extends keyof ViewerEventMap>(type: Type, detail: ViewerEventMap[Type]['detail']): void {
    if (!this.ended) this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  /** Runs `work`; a failure becomes an event, and an error that need not be caught. */
  private reported<T>(work: () => Promise<T>): Promise<T> {
    const done = work().catch((thrown: unknown) => {
      const error = new RestirError(toFailure(thrown));
      if (error.code !== 'CANCELLED') this.emit('error', { code: error.code, message: error.message });
      throw error;
    });
    done.catch(() => undefined);
    return done;
  }

  private inTurn<T>(work: () => Promise<T>): Promise<T> {
    const done = this.turn.then(work);
    this.turn = done.catch(() => undefined);
    return done;
  }

  /** Changes the picture between two frames. What only shows the film otherwise needs no new frame. */
  private set(name: string, value: Change['value'], work: (viewer: Viewer) => void, onlyFilm = false): Promise<void> {
    const apply = (viewer: Viewer) => {
      work(viewer);
      if (onlyFilm) viewer.present();
      this.emit('param-change', { name, value });
    };
    return this.reported(() => (onlyFilm ? this.loop.call(apply) : this.loop.change(apply)));
  }

  private source(): SceneSource {
    const { source } = this.wanted ?? this.shown ?? {};
    if (!source) throw invalid('There is no scene yet.');
    return source;
  }

  private surroundingsFor(environment: string | null | undefined): Surroundings | undefined {
    if (environment === undefined) return (this.wanted ?? this.shown)?.surroundings;
    return environment === null || environment === '' ? undefined : surroundingsOf(environment);
  }

  /** Shows a scene seen as `view` says, or, without one, as before. */
  private async open(source: SceneSource, surroundings: Surroundings | undefined, view: View | undefined): Promise<void> {
    if (this.ended) throw disposed();
    const wanted = (this.wanted = { source, surroundings, view });
    try {
      await this.loadAndPresent(source, surroundings, view);
    } finally {
      if (this.wanted === wanted) this.wanted = undefined;
    }
    if (this.shown) this.emit('load', this.shown);
  }

  private async loadAndPresent(source: SceneSource, surroundings: Surroundings | undefined, view: View | undefined): Promise<void> {
    const { lights, seed } = { ...this.settings, ...view };
    const progress: Progress = (stage, fraction, what) => this.emit('progress', { stage, fraction, what });
    progress('download', 0, 'Loading');
    // All that can start at once does: the wasm module, the adapter, the worker.
    const loading = this.loader.load(compileWasm(), { source, surroundings, lights, seed }, progress);
    loading.catch(() => undefined);
    await this.start();
    const { flat, contents = noContents } = await loading;
    progress('pipelines', 1, 'Uploading the scene');
    await this.present(flat, { source, surroundings, contents }, view);
  }

  private async present(flat: Uint8Array, given: Pick<Scene, 'source' | 'surroundings' | 'contents'>, view: View | undefined): Promise<void> {
    const { source, surroundings } = given;
    const take = (viewer: Viewer): void => {
      this.fresh = true;
      this.shown = { ...given, cameras: camerasOf(viewer), report: reportOf(viewer) };
      this.flat = flat;
      this.resolution.forget();
      const { scene: sceneIndex, variant } = source.kind === 'builtin' ? {} : source.choice;
      Object.assign(this.settings, { sceneIndex, variant });
      this.settings.environment = surroundings?.bytes ? undefined : surroundings?.name;
      this.settings.scene = { builtin: source.name, address: source.kind === 'address' ? source.address : '', file: undefined }[source.kind];
    };
    // Only a viewer is made in turn: a device lost meanwhile is replaced in turn, too, and the loop waits for that.
    const made = await this.inTurn(async () => {
      if (!this.viewer) await this.createViewer(flat, view, take);
      else return false;
      return true;
    });
    if (!made) await this.loop.change((viewer) => this.replaceScene(viewer, flat, view, take));
  }

  /** Once: is there WebGPU, and the module? */
  private async start(): Promise<void> {
    this.started ??= Promise.all([findAdapter(), startWasm()]).then(([{ software }]) => this.resolution.startAt(software ? 0.25 : 1));
    try {
      await this.started;
    } catch (error) {
      this.started = undefined;
      this.loader.cancel();
      throw error;
    }
  }

  private async replaceScene(viewer: Viewer, flat: Uint8Array, view: View | undefined, take: (viewer: Viewer) => void): Promise<void> {
    await viewer.load(flat);
    if (view?.values) this.taker.forgetValues(viewer);
    // What runs goes on from where it is.
    if (view) Object.assign(this.settings, { camera: '0', pose: undefined, time: 0, animation: '0' }, view);
    else if (!this.accumulating) this.settings.time = this.moment;
    take(viewer);
    if (view?.values) this.takeSettings(viewer);
    this.takeView(viewer);
  }

  private async createViewer(flat: Uint8Array, view: View = {}, take?: (viewer: Viewer) => void): Promise<void> {
    const size = this.resolution.size();
    const viewer = await Viewer.create(await sharedDevice(), this.canvas, flat, ...size);
    if (this.ended) {
      viewer.free();
      throw disposed();
    }
    this.viewer = viewer;
    this.halted = false;
    this.rendered = size;
    Object.assign(this.settings, view);
    take?.(viewer);
    this.takeSettings(viewer);
    this.takeView(viewer);
    this.loop.attach(viewer);
  }

  private rebuild(): Promise<void> {
    return this.inTurn(async () => {
      if (!this.flat) throw invalid('There is no scene yet.');
      this.freeViewer();
      if (!this.accumulating) this.settings.time = this.moment;
      await this.createViewer(this.flat);
      this.emit('restored', null);
    });
  }

  private freeViewer(): void {
    this.viewer?.free();
    this.viewer = undefined;
  }

  /** Whether the scene of these settings is shown. */
  private isOf(wanted: Settings, files: Pick<Scene, 'source' | 'surroundings'> | undefined): boolean {
    const { shown, settings } = this;
    if (!shown) return false;
    if (files) return files.source === shown.source && files.surroundings === shown.surroundings;
    const sceneOf = ({ scene, sceneIndex, variant, environment, lights, seed }: Settings) =>
      JSON.stringify([scene, sceneIndex, variant, environment, lights, lights && seed]);
    return sceneOf(settings) === sceneOf(wanted);
  }

  private takeLimits(): void {
    const { size, scale, budget, frames } = this.settings;
    Object.assign(this.resolution, { fixedSize: size, fixedScale: scale, budget: budget ?? defaultBudget });
    this.loop.frameLimit = frames ?? Infinity;
  }

  /** Gives a viewer all that says how its pictures are made. */
  private takeSettings(viewer: Viewer): void {
    this.takeLimits();
    this.taker.takeAll(viewer);
  }

  /** Gives the viewer of a new scene its moment and its camera. */
  private takeView(viewer: Viewer): void {
    const { settings } = this;
    if (settings.animation !== '0') {
      const { animation } = settings;
      this.taker.attempt(`animation=${animation}`, () => viewer.set_animation(animation), () => (settings.animation = '0'));
    }
    viewer.set_speed(settings.speed);
    viewer.set_time(settings.time);
    viewer.set_accumulate(this.accumulating);
    const first = () => this.sceneCamera.follow(viewer, '0');
    const { pose, camera } = settings;
    if (pose) this.taker.attempt('pose', () => this.sceneCamera.setPose(viewer, pose), first);
    else if (this.shown?.cameras.length) this.taker.attempt(`camera=${camera}`, () => this.sceneCamera.follow(viewer, camera), first);
  }

  private isInside(pixel: [number, number] | undefined): pixel is [number, number] {
    return pixel !== undefined && pixel[0] < this.rendered[0] && pixel[1] < this.rendered[1];
  }

  // Frames

  private beforeFrame(viewer: Viewer, seconds: number): boolean {
    const moved = this.input?.controls.update(seconds) ?? false;
    if (moved) {
      this.resolution.move();
      this.fade.end();
      this.emit('camera-change', this.sceneCamera.applyOrbit(viewer));
    }
    const [width, height] = this.resolution.size();
    const resized = width !== this.rendered[0] || height !== this.rendered[1];
    if (resized) {
      this.cover(viewer, width);
      viewer.resize(width, height);
      this.rendered = [width, height];
      // Time that runs goes on from where it is.
      if (!this.accumulating) viewer.set_time(this.moment);
    }
    return moved || resized;
  }

  /** Tells of the pipelines that the first picture waits for. */
  private making(made: number, all: number): void {
    if (!this.fresh) return;
    this.fresh = made < all;
    if (this.fresh) this.emit('progress', { stage: 'pipelines', fraction: 1, what: 'Making pipelines', count: [made, all] });
    else this.emit('progress', { stage: 'picture', fraction: 1, what: 'Rendering the first picture' });
  }

  /** Keeps the picture above the canvas where a sharper one is about to be rendered. */
  private cover(viewer: Viewer, width: number): void {
    this.fade.end();
    if (!this.resolution.adapts || width <= this.rendered[0] || viewer.frames() === 0) return;
    viewer.present();
    this.fade.keep();
  }

  private afterFrame(viewer: Viewer, milliseconds: number): void {
    this.resolution.observe(milliseconds);
    this.fade.begin();
    this.moment = viewer.time();
    this.shownView = this.settings.view;
    this.sceneCamera.syncOrbit(viewer);
    const [width, height] = this.rendered;
    this.emit('sample', { count: viewer.frames(), milliseconds, width, height, time: this.moment, complete: this.loop.isComplete(viewer) });
  }

  private picture(): Promise<ImageData> {
    return this.call((viewer) => this.read(viewer));
  }

  private async exr(): Promise<Blob> {
    const picture = await this.call((viewer) => readChannels(viewer, this.rendered, this.settings));
    // Few pictures are saved so: fetched only now.
    const { encodeExr } = await import('./exr.js');
    return encodeExr(picture);
  }

  private read(viewer: Viewer): Promise<ImageData> {
    return readDisplay(viewer, this.rendered);
  }

  // Losses

  private failed(thrown: unknown): void {
    const failure = toFailure(thrown);
    if (failure.code !== 'DEVICE') return this.halt(failure);
    const now = performance.now();
    this.losses = [...this.losses.filter((time) => now - time < lossesWithin), now];
    const final = this.losses.length >= mostLosses;
    this.emit('devicelost', { message: failure.message, final });
    if (final) this.halt(failure);
    else this.rebuild().catch((error: unknown) => this.halt(toFailure(error)));
  }

  /** The renderer is gone, and with it all that waits for it. */
  private halt(failure: Failure): void {
    this.halted = true;
    this.loop.stop(new RestirError(failure));
    this.emit('error', { ...failure, stopped: true });
  }
}

const camerasOf = (viewer: Viewer) => JSON.parse(viewer.cameras()) as Camera[];
const reportOf = (viewer: Viewer) => JSON.parse(viewer.info()) as SceneReport;
