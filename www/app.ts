// The page: joins the menus, the URL, the loader and the render loop.
import { findAdapter } from './adapter.js';
import type { Camera, Description, SceneReport, Stats, TechniqueInfo } from './api.js';
import { OrbitCamera } from './camera.js';
import { Controls } from './controls.js';
import { acceptDrops, readDropped, surroundingsOf } from './files.js';
import { SceneLoader } from './loader.js';
import { toFailure } from './messages.js';
import { byId, clearError, showError, showProgress, showStatus, showWarnings } from './notices.js';
import { type Group, fillMenu, isDefault, showPanel } from './panel.js';
import init, { Viewer, describe } from './pkg/restir.js';
import type { Choice, Contents, Loaded, SceneSource, Surroundings } from './protocol.js';
import { RenderLoop } from './render-loop.js';
import { Resolution } from './resolution.js';
import { TimeControls } from './time.js';
import { readQuery, writeQuery } from './url-state.js';
import { compileWasm } from './wasm.js';

/** What the command line takes by default, too. */
const defaultTechnique = 'restir-di';
const defaultScene = 'cornell';
/** Milliseconds between read-backs of counters and timings. */
const statsInterval = 500;
const environments: [string, string][] = [
  ['', 'of the scene'],
  ['sky', 'sun and sky'],
  ['sky:elevation=6,turbidity=3', 'low sun'],
  ['white', 'even white'],
];
const scales: [string, string][] = [
  ['', 'automatic'],
  ['0.25', '¼'],
  ['0.5', '½'],
  ['0.75', '¾'],
  ['1', 'full'],
];

const menu = (id: string) => byId(id, HTMLSelectElement);
const button = (id: string) => byId(id, HTMLButtonElement);

class App {
  private readonly canvas = byId('canvas', HTMLCanvasElement);
  private readonly compiled = compileWasm();
  private readonly loader = new SceneLoader();
  private readonly orbit = new OrbitCamera();
  private readonly controls = new Controls(this.canvas, this.orbit);
  private readonly resolution = new Resolution(this.canvas);
  private readonly time = new TimeControls({
    play: (on) => this.setAccumulate(!on),
    seek: (seconds) => {
      this.state.time = seconds;
      return this.change((viewer) => viewer.set_time(seconds));
    },
    speed: (factor) => {
      this.state.speed = factor;
      this.change((viewer) => viewer.set_speed(factor));
    },
    animation: (index) => {
      this.state.animation = index;
      this.change((viewer) => viewer.set_animation(index));
    },
  });
  private readonly query = readQuery(location.search, defaultTechnique);
  private readonly state = this.query.state;
  private description: Description | undefined;
  private viewer: Viewer | undefined;
  /** What is shown, to be read again under another environment. */
  private source: SceneSource = { kind: 'builtin', name: this.state.scene ?? defaultScene };
  private surroundings = this.state.environment === undefined ? undefined : surroundingsOf(this.state.environment);
  /** The scene as the worker made it: a lost device is rebuilt from it. */
  private flat: Uint8Array | undefined;
  private cameras: Camera[] = [];
  /** Indices of cameras that move. */
  private movingCameras: number[] = [];
  private adapter = '';
  private rendered: [number, number] = [0, 0];
  private stats: Stats | undefined;
  private statsTime = 0;
  private urlTimer = 0;
  readonly loop = new RenderLoop({
    beforeFrame: (viewer, seconds) => this.beforeFrame(viewer, seconds),
    afterFrame: (viewer, milliseconds) => this.afterFrame(viewer, milliseconds),
    failed: (error) => this.rendererFailed(error),
  });

  /** Everything that can start at once does: the wasm module, the adapter, the worker. */
  async start(): Promise<void> {
    this.loop.frameLimit = this.state.frames ?? Infinity;
    this.resolution.fixedSize = this.state.size;
    this.resolution.fixedScale = this.state.scale;
    try {
      const scene = this.flatten(this.source, this.surroundings);
      scene.catch(() => undefined);
      const [adapter, module] = await Promise.all([findAdapter(), this.compiled]);
      this.resolution.startAt(adapter.software ? 0.25 : 1);
      await init({ module_or_path: module });
      this.description = JSON.parse(describe()) as Description;
      this.listen();
      this.showMenus();
      const problem = await this.open(this.source, this.surroundings, scene);
      // Without what could not be had: first the environment, then the scene.
      if (!this.flat && this.surroundings) await this.open(this.source, undefined);
      if (!this.flat) await this.open({ kind: 'builtin', name: defaultScene }, undefined);
      if (problem) showError(problem);
    } catch (error) {
      showProgress(undefined);
      showError(error, { final: true });
    }
  }

  // Scenes

  private flatten(source: SceneSource, surroundings: Surroundings | undefined): Promise<Loaded> {
    const { lights, seed } = this.state;
    showProgress(0, 'Loading');
    return this.loader.load(this.compiled, { source, surroundings, lights, seed }, showProgress);
  }

  /**
   * Shows a scene, or says why not and keeps the former one. With `keepView` the camera stays where it is. Resolves to what
   * went wrong, if anything did.
   */
  private async open(
    source: SceneSource,
    surroundings: Surroundings | undefined,
    loading = this.flatten(source, surroundings),
    keepView = source === this.source,
  ): Promise<unknown> {
    let problem: unknown;
    try {
      const { flat, contents } = await loading;
      showProgress(1, 'Starting the renderer', { cancellable: false });
      if (this.viewer) await this.loop.change((viewer) => this.replaceScene(viewer, flat, keepView));
      else await this.createViewer(flat);
      this.flat = flat;
      this.source = source;
      this.surroundings = surroundings;
      this.state.environment = surroundings?.bytes ? undefined : surroundings?.name;
      this.state.scene = source.kind === 'builtin' ? source.name : undefined;
      clearError();
      this.showContents(source, contents);
      this.writeUrl();
    } catch (error) {
      problem = error;
      // A load that made way for another leaves the bar to that.
      if (toFailure(error).code === 'CANCELLED' && this.loader.busy) return problem;
      if (toFailure(error).code !== 'CANCELLED') showError(error);
    }
    this.showSceneMenu(this.source);
    this.showEnvironmentMenu();
    showProgress(undefined);
    return problem;
  }

  private async openFiles(files: File[]): Promise<void> {
    try {
      const { source = this.source, surroundings = this.surroundings } = await readDropped(files);
      await this.open(source, surroundings);
    } catch (error) {
      showError(error);
    }
  }

  /** Loads the same file again with another choice. */
  private async choose(choice: Choice): Promise<void> {
    const { source, surroundings } = this;
    if (source.kind !== 'file') return;
    const chosen = { ...source, choice: { ...source.choice, ...choice } };
    await this.open(chosen, surroundings, this.flatten(chosen, surroundings), choice.scene === undefined);
  }

  private async replaceScene(viewer: Viewer, flat: Uint8Array, keepView: boolean): Promise<void> {
    await viewer.load(flat);
    if (keepView) this.state.pose = this.orbit.toCamera();
    else Object.assign(this.state, { camera: '0', pose: undefined, time: 0, animation: '0' });
    this.sceneOpened(viewer);
  }

  private async createViewer(flat: Uint8Array): Promise<void> {
    this.rendered = this.resolution.size();
    this.viewer = await Viewer.create(this.canvas, flat, ...this.rendered);
    this.applyState(this.viewer);
    this.sceneOpened(this.viewer);
    this.loop.attach(this.viewer);
  }

  private sceneOpened(viewer: Viewer): void {
    this.cameras = JSON.parse(viewer.cameras()) as Camera[];
    const report = JSON.parse(viewer.info()) as SceneReport;
    this.adapter = report.adapter;
    this.movingCameras = report.moving_cameras;
    this.openTime(viewer, report);
    showWarnings([...this.query.warnings, ...report.warnings]);
    fillMenu(menu('camera'), this.cameras.map((camera, index) => [String(index), camera.name || `camera ${index}`]), String(this.cameraIndex()));
    this.takeCamera(viewer);
  }

  // Time

  /** Takes the moment, the speed and the animation that the address asks for. */
  private openTime(viewer: Viewer, report: SceneReport): void {
    const { state } = this;
    try {
      if (state.animation !== '0') viewer.set_animation(state.animation);
    } catch (error) {
      this.query.warnings.push(`animation=${state.animation} in the address: ${toFailure(error).message}`);
      state.animation = '0';
    }
    viewer.set_speed(state.speed);
    viewer.set_time(state.time);
    const turns = Number(state.values.get('render.environment_rotation_rate') ?? 0) !== 0;
    const accumulate = state.accumulate ?? !(report.animated || turns);
    viewer.set_accumulate(accumulate);
    this.time.open(report, viewer.animation(), state.speed);
    this.showAccumulate(accumulate);
  }

  /** Averages frames while time stands still, or lets it run. */
  private setAccumulate(on: boolean): void {
    this.state.accumulate = on;
    this.showAccumulate(on);
    this.change((viewer) => {
      viewer.set_accumulate(on);
      // A link shows the moment at which time was stopped.
      this.state.time = viewer.time();
      if (on) viewer.set_time(viewer.time());
      this.writeUrl();
    });
  }

  private showAccumulate(on: boolean): void {
    byId('accumulate', HTMLInputElement).checked = on;
    this.time.showPlaying(!on);
  }

  // Cameras

  private cameraIndex(): number {
    const named = this.cameras.findIndex(({ name }) => name === this.state.camera);
    const index = named >= 0 ? named : Number(this.state.camera);
    return this.cameras[index] ? index : 0;
  }

  /** Goes to the chosen camera of the scene, or to where the address says the user was. */
  private takeCamera(viewer: Viewer): void {
    const camera = this.cameras[this.cameraIndex()];
    if (!camera) return;
    if (this.state.pose) {
      const posed = { ...camera, ...this.state.pose };
      this.orbit.set(posed, viewer.bounds());
      viewer.set_camera(JSON.stringify(posed));
      return;
    }
    viewer.follow_camera(this.cameraIndex());
    this.orbit.set(JSON.parse(viewer.camera()) as Camera, viewer.bounds());
  }

  /** Whether the picture is seen through a camera that moves by itself. */
  private followsCamera(): boolean {
    return this.state.pose === undefined && this.movingCameras.includes(this.cameraIndex());
  }

  // Settings

  private technique(): TechniqueInfo | undefined {
    return this.description?.techniques.find(({ id }) => id === this.state.technique);
  }

  private groups(): Group[] {
    const { film, render } = this.description ?? {};
    return [
      { title: this.technique()?.title ?? '', prefix: '', params: this.technique()?.params ?? [] },
      { title: 'Render', prefix: 'render.', params: render?.params ?? [] },
      { title: 'Film', prefix: 'film.', params: film?.params ?? [] },
    ];
  }

  /** Gives the viewer all that the address asks for; what it does not take becomes a warning and is dropped. */
  private applyState(viewer: Viewer): void {
    const attempt = (what: string, work: () => void, drop: () => void) => {
      try {
        work();
      } catch (error) {
        this.query.warnings.push(`${what} in the address: ${toFailure(error).message}`);
        drop();
      }
    };
    const { state } = this;
    attempt(`technique=${state.technique}`, () => viewer.set_technique(state.technique), () => {
      state.technique = defaultTechnique;
      viewer.set_technique(defaultTechnique);
    });
    for (const [key, value] of state.values) attempt(`${key}=${value}`, () => viewer.set(key, value), () => state.values.delete(key));
    attempt(`view=${state.view}`, () => viewer.set_view(state.view), () => (state.view = 'radiance'));
    viewer.set_seed(state.seed);
    this.showMenus();
  }

  private chooseTechnique(id: string): void {
    const { state } = this;
    state.technique = id;
    // A technique starts from its own defaults; the film's and renderer's settings stay.
    for (const key of [...state.values.keys()].filter((name) => !name.includes('.'))) state.values.delete(key);
    if (!this.technique()?.views.includes(state.view)) state.view = 'radiance';
    this.showMenus();
    this.change((viewer) => {
      viewer.set_technique(id);
      viewer.set_view(state.view);
    });
  }

  private setParameter(key: string, value: string | undefined): void {
    const parameter = this.groups().flatMap(({ prefix, params }) => params.filter(({ name }) => prefix + name === key))[0];
    if (!parameter) return;
    const text = value ?? String(parameter.default);
    if (isDefault(parameter, text)) this.state.values.delete(key);
    else this.state.values.set(key, text);
    this.change((viewer) => viewer.set(key, text), key.startsWith('film.'));
  }

  /** Changes the picture between two frames, and the address with it. What only shows the film otherwise needs no new frame. */
  private change(work: (viewer: Viewer) => void, onlyFilm = false): Promise<void> {
    const shown = (viewer: Viewer) => {
      work(viewer);
      viewer.present();
    };
    const done = onlyFilm ? this.loop.call(shown) : this.loop.change(work);
    this.writeUrl();
    return done.catch((error: unknown) => showError(error));
  }

  // Menus and events

  private showMenus(): void {
    const { techniques = [], scenes = [] } = this.description ?? {};
    const technique = this.technique();
    const current = this.state.scene ?? '';
    fillMenu(menu('scene'), scenes.map(({ example, title }) => [example, title]), current);
    fillMenu(menu('technique'), techniques.map(({ id, title }) => [id, title]), this.state.technique);
    fillMenu(menu('view'), (technique?.views ?? []).map((name) => [name, name]), this.state.view);
    fillMenu(menu('scale'), scales, String(this.state.scale ?? ''));
    const summary = byId('summary', HTMLElement);
    summary.textContent = technique?.summary ?? '';
    if (technique && !technique.unbiased) {
      summary.append(' ', Object.assign(document.createElement('span'), { className: 'bias', textContent: technique.bias }));
    }
    showPanel(byId('panel', HTMLElement), this.groups(), this.state.values, (key, value) => this.setParameter(key, value));
  }

  /** The scene menu after a load: a file of the user's stands in it under its name while it is shown. */
  private showSceneMenu(source: SceneSource): void {
    const entries = (this.description?.scenes ?? []).map(({ example, title }): [string, string] => [example, title]);
    const chosen = this.state.scene ?? (source.kind === 'file' ? source.name : menu('scene').value);
    fillMenu(menu('scene'), entries, chosen);
  }

  /** The environment menu after a load; a map stands in it under its name while it is shown. */
  private showEnvironmentMenu(): void {
    fillMenu(menu('environment'), environments, this.surroundings?.name ?? '');
  }

  /** Menus for what can be chosen in the file shown; hidden where there is no choice. */
  private showContents(source: SceneSource, { scenes, scene, variants }: Contents = { scenes: [], scene: 0, variants: [] }): void {
    const choice = source.kind === 'file' ? source.choice : {};
    byId('file-scene-row', HTMLElement).hidden = scenes.length < 2;
    byId('variant-row', HTMLElement).hidden = variants.length === 0;
    fillMenu(menu('file-scene'), scenes.map((name, index) => [String(index), name]), String(choice.scene ?? scene));
    fillMenu(menu('variant'), [['', 'default'], ...variants.map((name): [string, string] => [name, name])], choice.variant ?? '');
  }

  private listen(): void {
    button('cancel').addEventListener('click', () => this.loader.cancel());
    menu('file-scene').addEventListener('change', () => void this.choose({ scene: Number(menu('file-scene').value) }));
    menu('variant').addEventListener('change', () => void this.choose({ variant: menu('variant').value || undefined }));
    menu('scene').addEventListener('change', () => void this.open({ kind: 'builtin', name: menu('scene').value }, this.surroundings));
    menu('environment').addEventListener('change', () => {
      const text = menu('environment').value;
      void this.open(this.source, text === '' ? undefined : surroundingsOf(text));
    });
    menu('technique').addEventListener('change', () => this.chooseTechnique(menu('technique').value));
    menu('view').addEventListener('change', () => {
      this.state.view = menu('view').value;
      this.change((viewer) => viewer.set_view(this.state.view));
    });
    menu('camera').addEventListener('change', () => {
      this.state.camera = menu('camera').value;
      this.state.pose = undefined;
      this.change((viewer) => this.takeCamera(viewer));
    });
    menu('scale').addEventListener('change', () => {
      const text = menu('scale').value;
      this.state.scale = this.resolution.fixedScale = text === '' ? undefined : Number(text);
      this.writeUrl();
    });
    const accumulate = byId('accumulate', HTMLInputElement);
    accumulate.addEventListener('change', () => this.setAccumulate(accumulate.checked));
    menu('navigation').addEventListener('change', () => (this.controls.mode = menu('navigation').value === 'fly' ? 'fly' : 'orbit'));

    const file = byId('file', HTMLInputElement);
    button('open').addEventListener('click', () => file.click());
    file.addEventListener('change', () => {
      void this.openFiles([...(file.files ?? [])]);
      file.value = '';
    });
    acceptDrops(byId('drop', HTMLElement), (files) => void this.openFiles(files));

    button('pause').addEventListener('click', () => this.pause(!this.loop.paused));
    button('step').addEventListener('click', () => {
      this.pause(true);
      this.loop.step();
    });
    button('reset').addEventListener('click', () => this.change((viewer) => viewer.reset()));
    button('fold').addEventListener('click', () => this.fold());
    addEventListener('keydown', (event) => this.shortcut(event));
  }

  private shortcut(event: KeyboardEvent): void {
    const typing = event.target instanceof Element && event.target.closest('button, input, select, summary');
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const buttons: Record<string, string> = { ' ': 'pause', '.': 'step', r: 'reset', h: 'fold', p: 'play' };
    const id = buttons[event.key];
    if (!id) return;
    event.preventDefault();
    button(id).click();
  }

  private pause(paused: boolean): void {
    this.loop.paused = paused;
    button('pause').setAttribute('aria-pressed', String(paused));
  }

  private fold(): void {
    const settings = byId('settings', HTMLElement);
    settings.hidden = !settings.hidden;
    byId('side', HTMLElement).classList.toggle('folded', settings.hidden);
    button('fold').setAttribute('aria-expanded', String(!settings.hidden));
  }

  /** Writes the address a moment later: a slider moves faster than browsers allow the address to change. */
  private writeUrl(): void {
    clearTimeout(this.urlTimer);
    this.urlTimer = window.setTimeout(() => {
      history.replaceState(null, '', location.pathname + writeQuery(this.state, defaultTechnique) + location.hash);
    }, 300);
  }

  // Frames

  private beforeFrame(viewer: Viewer, seconds: number): boolean {
    const moved = this.controls.update(seconds);
    if (moved) {
      const camera = this.orbit.toCamera();
      viewer.set_camera(JSON.stringify(camera));
      this.state.pose = camera;
      this.writeUrl();
    }
    const [width, height] = this.resolution.size();
    const resized = width !== this.rendered[0] || height !== this.rendered[1];
    if (resized) {
      viewer.resize(width, height);
      this.rendered = [width, height];
    }
    return moved || resized;
  }

  private async afterFrame(viewer: Viewer, milliseconds: number): Promise<void> {
    performance.mark('picture');
    this.resolution.observe(milliseconds);
    this.time.showTime(viewer.time());
    // The user takes over from where the camera is.
    if (this.followsCamera()) this.orbit.set(JSON.parse(viewer.camera()) as Camera, viewer.bounds());
    const now = performance.now();
    if (now - this.statsTime > statsInterval || this.loop.isComplete(viewer)) {
      this.statsTime = now;
      this.stats = JSON.parse(await viewer.stats()) as Stats;
    }
    showStatus({ frames: viewer.frames(), milliseconds, size: this.rendered, adapter: this.adapter, stats: this.stats });
  }

  private rendererFailed(error: unknown): void {
    const lost = toFailure(error).code !== 'INTERNAL';
    // After an internal failure the wasm module is in an unknown state: only a reload is a restart.
    showError(error, { onRestart: lost ? () => void this.restart() : () => location.reload() });
  }

  private async restart(): Promise<void> {
    if (!this.flat) return location.reload();
    try {
      this.viewer?.free();
      await this.createViewer(this.flat);
    } catch (error) {
      showError(error, { onRestart: () => void this.restart() });
    }
  }
}

const app = new App();

declare global {
  interface Window {
    /** For the console and the tests: runs work on the viewer between two frames. */
    restir?: { call: RenderLoop['call'] };
  }
}
window.restir = { call: (work) => app.loop.call(work) };

void app.start();
