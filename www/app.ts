// The page: joins the menus, the panel, the URL and the notices to a viewer.
import { type Address, type OwnFiles, PageAddress, readAddress } from './address.js';
import type { Description, SceneReport, Stats, TechniqueInfo } from './api.js';
import { acceptDrops, save } from './files.js';
import { byId, clearError, hideProgress, showError, showProgress, showStatus, showWarnings } from './notices.js';
import { CameraMenu } from './camera-menu.js';
import { commandLine } from './command.js';
import { Compare } from './compare.js';
import { Difference } from './difference.js';
import { ErrorMeter } from './error-meter.js';
import { Inspector } from './inspector.js';
import { Legend } from './legend.js';
import { type Group, fillMenu, filterPanel, markBiases, showPanel } from './panel.js';
import type { Contents, SceneSource } from './protocol.js';
import { Recording } from './recording.js';
import { Steps } from './steps.js';
import { TimeControls } from './time.js';
import { showTiming } from './timing.js';
import { TimingHistory } from './timing-history.js';
import { type Change, RestirViewer, type Sample, type Scene, type ViewerFailure } from './viewer.js';

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

const budgets: [string, string][] = [
  ['16', '16 ms a frame'],
  ['33', '33 ms'],
  ['', '100 ms'],
  ['250', '250 ms'],
];

const menu = (id: string) => byId(id, HTMLSelectElement);
const button = (id: string) => byId(id, HTMLButtonElement);

const toggleFullscreen = () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());

class App {
  private readonly query = readAddress(location.search);
  readonly view = new RestirViewer(byId('canvas', HTMLCanvasElement), this.query.state);
  readonly compare = new Compare(this.view, byId('canvas', HTMLCanvasElement), (change) => this.showCompare(change));
  private readonly cameras = new CameraMenu(this.view);
  /** Whose settings the panel shows. */
  private edited = this.view;
  private readonly legend = new Legend(
    () => this.edited,
    (range) => {
      const ends = ['film.range_low', 'film.range_high'];
      const set = ends.map((key, at) => this.edited.setParam(key, range && String(range[at])));
      void this.settled(Promise.all(set).then(() => undefined));
    },
  );
  private readonly time = new TimeControls({
    play: (on) => this.setAccumulate(!on),
    seek: (seconds) => this.view.setTime(seconds).catch(() => undefined),
    speed: (factor) => void this.view.setSpeed(factor),
    animation: (index) => void this.view.setAnimation(index),
  });
  private readonly address = new PageAddress(
    () => this.link(),
    () => this.ownFiles(),
    (address, files) => this.showAddress(address, files),
  );
  private description: Description | undefined;
  private readonly history = new TimingHistory();
  private stats: Stats | undefined;
  private statsTime = 0;
  private hadScene = false;
  /** What is listed. */
  private warnings: string[] = [];
  /** Settings of the address that were not taken, and are not listed yet. */
  private readonly refused = [...this.query.unread];
  /** Whether the wasm module has failed. */
  private broken = false;
  private meter: ErrorMeter | undefined;
  private difference: Difference | undefined;
  /** Of the last frame: rendered pixels, frames in the picture, and the scene's moment. */
  private size: [number, number] = [1280, 720];
  private frames = 0;
  private moment = 0;

  /** Shows what the address says. */
  open(): Promise<void> {
    return this.address.restore(this.start());
  }

  private async start(): Promise<void> {
    const { view } = this;
    const { scene = defaultScene, environment, sceneIndex, variant } = this.query.state;
    const choice = { ...(sceneIndex !== undefined && { scene: sceneIndex }), ...(variant !== undefined && { variant }) };
    view.controls = 'orbit';
    // On a small screen the picture comes first.
    if (matchMedia('(max-width: 30rem)').matches) this.fold();
    this.follow();
    this.meter = new ErrorMeter(view);
    this.difference = new Difference(view, this.compare);
    const inspector: Inspector = new Inspector(view, byId('canvas', HTMLCanvasElement), () => steps.end());
    const steps = new Steps(view, () => {
      void inspector.end();
      this.pause(true);
    });
    new Recording(view, this.compare, () => this.fileName());
    const opening = view.load(scene, { environment, choice });
    try {
      this.description = await RestirViewer.describe();
      this.listen();
      this.showMenus();
    } catch (problem) {
      return showError(problem, { final: true });
    }
    try {
      await opening;
      if (this.query.second === undefined) return;
      await this.compare.open(this.query.second);
      this.addWarnings();
    } catch (problem) {
      // The user has chosen something else meanwhile.
      if (view.opening) return;
      // Without what could not be had: first the environment, then the scene, and with that how it was to be seen.
      if (environment !== undefined && !view.scene) await this.settle(view.load(scene, { environment: null, choice }));
      if (!view.scene) {
        Object.assign(view.settings, { camera: '0', pose: undefined, time: 0, animation: '0' });
        await this.settle(view.load(defaultScene, { environment: null }));
      }
      if (view.scene && (problem as { code?: unknown }).code !== 'CANCELLED') showError(problem);
    }
  }

  /** Shows what the viewer tells. */
  private follow(): void {
    const { view } = this;
    view.addEventListener('progress', ({ detail }) => showProgress(detail.stage, detail.fraction, detail.what, detail.count));
    view.addEventListener('load', ({ detail }) => this.showScene(detail));
    view.addEventListener('sample', ({ detail }) => this.showSample(detail));
    view.addEventListener('error', ({ detail }) => this.showFailure(detail));
    view.addEventListener('restored', clearError);
    view.addEventListener('camera-change', () => this.address.changed());
    view.addEventListener('param-change', ({ detail }) => this.noteChange(detail));
  }

  /** What is chosen from a menu can be taken back by the browser's Back. */
  private noteChange({ name }: Change): void {
    if (['technique', 'preset', 'view'].includes(name)) this.address.chosen();
    else this.address.changed();
  }

  private showFailure(failure: ViewerFailure): void {
    const { code, message, setting, stopped } = failure;
    if (setting !== undefined) return void this.refused.push({ setting, message });
    // After an internal failure the wasm module is in an unknown state: only a reload is a restart.
    const restore = () => {
      for (const each of this.viewers()) if (each.stopped) void each.restore();
    };
    if (code === 'INTERNAL') this.broken = true;
    if (stopped) hideProgress();
    // While a viewer stands still, whatever else fails offers to start it again, too.
    if (stopped || this.viewers().some((each) => each.stopped)) showError(failure, { onRestart: this.broken ? () => location.reload() : restore });
    else showError(failure, { final: code === 'NO_WEBGPU' || code === 'NO_ADAPTER' });
  }

  // Scenes

  /** Waits for a load that the user asked for. Its failure is an event; the menus show what is there all the same. */
  private async settle(loading: Promise<void>): Promise<void> {
    const failed = await loading.then(() => false, () => true);
    // A load that made way for another leaves the bar to that.
    if (this.view.opening) return;
    if (failed) hideProgress();
    if (this.view.scene) this.showSources(this.view.scene);
  }

  private showScene(scene: Scene): void {
    const { report, contents } = scene;
    clearError();
    this.showWarnings(report);
    // Settings of the address that were not taken are gone; later scenes leave the panel as it is.
    if (!this.hadScene) this.showMenus();
    this.hadScene = true;
    this.showSources(scene);
    this.showContents(scene.source, contents);
    this.showTime(report);
    // The range of depths is the scene's.
    void this.legend.update();
    this.address.chosen();
  }

  private showWarnings(report: SceneReport): void {
    // Those of the address are told once.
    this.warnings = report.warnings;
    this.addWarnings();
  }

  /** Shows what was refused since the others were shown, too. */
  private addWarnings(): void {
    const refused = this.refused.splice(0).map(({ setting, message }) => `${setting} in the address: ${message}`);
    this.warnings = [...refused, ...this.warnings];
    showWarnings(this.warnings);
  }

  /** Where the scene or what surrounds it are files of the user's, these. */
  private ownFiles(): OwnFiles | undefined {
    const { source, surroundings } = this.view.scene ?? {};
    return source && (source.kind === 'file' || surroundings?.bytes) ? { source, surroundings } : undefined;
  }

  /** Shows what an address says to which the user has gone back. */
  private async showAddress(address: Address, files: OwnFiles | undefined): Promise<void> {
    const { view, compare } = this;
    const before = view.scene;
    this.refused.push(...address.unread);
    const showing = view.show(address.state, files);
    await this.settle(showing);
    // Gone further meanwhile, or there is nothing to compare with.
    if ((await showing.then(() => false, () => true)) || view.opening) return;
    if (address.second === undefined) compare.close();
    else await compare.show(address.second);
    this.showMenus();
    // Another scene has been shown with all that belongs to it, but for the second picture's warnings.
    if (view.scene !== before) return this.addWarnings();
    if (!view.scene) return;
    this.showTime(view.scene.report);
    this.showWarnings(view.scene.report);
  }

  // Time

  private showTime(report: SceneReport): void {
    const { animation, speed } = this.view.settings;
    const named = report.animations.findIndex(({ name }) => name === animation);
    this.time.open(report, named >= 0 ? named : Number(animation), speed);
    this.showAccumulate(this.view.accumulating);
  }

  /** Averages frames while time stands still, or lets it run. */
  private setAccumulate(on: boolean): void {
    this.showAccumulate(on);
    void this.view.setAccumulate(on);
  }

  private showAccumulate(on: boolean): void {
    byId('accumulate', HTMLInputElement).checked = on;
    this.time.showPlaying(!on);
  }

  // Settings

  private technique(): TechniqueInfo | undefined {
    return this.description?.techniques.find(({ id }) => id === this.edited.settings.technique);
  }

  private groups(): Group[] {
    const { film, render } = this.description ?? {};
    return [
      { title: this.technique()?.title ?? '', prefix: '', params: this.technique()?.params ?? [] },
      { title: 'Render', prefix: 'render.', params: render?.params ?? [] },
      { title: 'Film', prefix: 'film.', params: film?.params ?? [] },
    ];
  }

  /** Shows what a change of technique or preset has brought with it. */
  private async settled(change: Promise<void>): Promise<void> {
    await change.catch(() => undefined);
    this.showMenus();
    this.showAccumulate(this.view.accumulating);
  }

  private setParam(key: string, value: string | undefined): void {
    const changed = () => {
      this.showPresets();
      void this.showBiases();
      void this.legend.update();
      this.showAccumulate(this.view.accumulating);
    };
    // What was refused is shown as it was.
    void this.edited.setParam(key, value).then(changed, () => this.showMenus());
  }

  private showPresets(): void {
    const presets = this.description?.presets ?? [];
    const chosen = presets.find(({ id }) => id === this.edited.preset);
    fillMenu(menu('preset'), [['', 'none'], ...presets.map(({ id, title }): [string, string] => [id, title])], chosen?.id ?? '');
    menu('preset').title = chosen?.doc ?? '';
  }

  // Menus and events

  private showMenus(): void {
    const { settings } = this.edited;
    const technique = this.technique();
    fillMenu(menu('scene'), this.scenes(), this.view.settings.scene ?? menu('scene').value);
    fillMenu(menu('technique'), (this.description?.techniques ?? []).map(({ id, title }) => [id, title]), settings.technique);
    this.showPresets();
    fillMenu(menu('view'), (technique?.views ?? []).map(({ name }) => [name, name]), settings.view);
    void this.legend.update();
    fillMenu(menu('scale'), scales, String(settings.scale ?? ''));
    this.showBudget();
    const summary = byId('summary', HTMLElement);
    summary.textContent = technique?.summary ?? '';
    if (technique && !technique.unbiased) {
      summary.append(' ', Object.assign(document.createElement('span'), { className: 'bias', textContent: technique.bias }));
    }
    showPanel(byId('panel', HTMLElement), this.groups(), settings.values, (key, value) => this.setParam(key, value));
    filterPanel(byId('panel', HTMLElement), byId('search', HTMLInputElement).value);
    void this.showBiases();
  }

  /** Marks what biases the picture as it is now. */
  private async showBiases(): Promise<void> {
    const { edited } = this;
    const biases = await edited.biases().catch(() => []);
    if (edited === this.edited) markBiases(byId('panel', HTMLElement), biases);
  }

  private showBudget(): void {
    const { budget, scale, size } = this.view.settings;
    fillMenu(menu('budget'), budgets, String(budget ?? ''));
    menu('budget').disabled = scale !== undefined || size !== undefined;
  }

  private scenes(): [string, string][] {
    return (this.description?.scenes ?? []).map(({ example, title }) => [example, title]);
  }

  /** The menus of scene and environment after a load: a file of the user's stands in them under its name while it is shown. */
  private showSources({ source, surroundings }: Scene): void {
    fillMenu(menu('scene'), this.scenes(), this.view.settings.scene ?? source.name);
    fillMenu(menu('environment'), environments, surroundings?.name ?? '');
  }

  /** Menus for what can be chosen in the file shown; hidden where there is no choice. */
  private showContents(source: SceneSource, { scenes, scene, variants }: Contents = { scenes: [], scene: 0, variants: [] }): void {
    const choice = source.kind === 'builtin' ? {} : source.choice;
    byId('file-scene-row', HTMLElement).hidden = scenes.length < 2;
    byId('variant-row', HTMLElement).hidden = variants.length === 0;
    fillMenu(menu('file-scene'), scenes.map((name, index) => [String(index), name]), String(choice.scene ?? scene));
    fillMenu(menu('variant'), [['', 'default'], ...variants.map((name): [string, string] => [name, name])], choice.variant ?? '');
  }

  private listen(): void {
    const { view } = this;
    button('cancel').addEventListener('click', () => view.cancel());
    menu('file-scene').addEventListener('change', () => void this.settle(view.choose({ scene: Number(menu('file-scene').value) })));
    menu('variant').addEventListener('change', () => void this.settle(view.choose({ variant: menu('variant').value || undefined })));
    menu('scene').addEventListener('change', () => void this.settle(view.load(menu('scene').value)));
    menu('environment').addEventListener('change', () => void this.settle(view.setEnvironment(menu('environment').value || null)));
    menu('technique').addEventListener('change', () => void this.settled(this.edited.setTechnique(menu('technique').value)));
    menu('preset').addEventListener('change', () => {
      const { value } = menu('preset');
      // None is no settings of its own: the technique's defaults.
      void this.settled(value ? this.edited.setPreset(value) : this.edited.setTechnique(this.edited.settings.technique));
    });
    const search = byId('search', HTMLInputElement);
    search.addEventListener('input', () => filterPanel(byId('panel', HTMLElement), search.value));
    menu('view').addEventListener('change', () => {
      // A range belongs to one view.
      this.legend.forgetRange();
      void this.edited.setView(menu('view').value).then(() => this.legend.update(), () => this.showMenus());
    });
    menu('target').addEventListener('change', () => this.edit(menu('target').value));
    button('compare').addEventListener('click', () => (this.compare.other ? this.compare.close() : void this.openCompare()));
    menu('scale').addEventListener('change', () => {
      // A size in pixels, as a reference sets it, goes before any scale.
      if (view.settings.size) void view.setSize(undefined);
      void view.setScale(Number(menu('scale').value) || undefined);
    });
    menu('budget').addEventListener('change', () => void view.setBudget(Number(menu('budget').value) || undefined));
    view.addEventListener('param-change', ({ detail }) => ['scale', 'size'].includes(detail.name) && this.showBudget());
    const accumulate = byId('accumulate', HTMLInputElement);
    accumulate.addEventListener('change', () => this.setAccumulate(accumulate.checked));
    menu('navigation').addEventListener('change', () => (view.controls = menu('navigation').value === 'fly' ? 'fly' : 'orbit'));

    const file = byId('file', HTMLInputElement);
    button('gallery').addEventListener('click', () => void this.openGallery());
    button('open').addEventListener('click', () => file.click());
    file.addEventListener('change', () => {
      void this.settle(view.loadFiles([...(file.files ?? [])]));
      file.value = '';
    });
    acceptDrops(byId('drop', HTMLElement), (files) => void this.settle(view.loadFiles(files)));

    button('pause').addEventListener('click', () => this.pause(!view.paused));
    button('step').addEventListener('click', () => {
      this.pause(true);
      for (const each of this.viewers()) each.step();
    });
    button('reset').addEventListener('click', () => {
      for (const each of this.viewers()) void each.reset();
    });
    byId('timing', HTMLDetailsElement).addEventListener('toggle', () => this.stats && showTiming(this.stats));
    button('save').addEventListener('click', () => void this.save('png'));
    button('save-exr').addEventListener('click', () => void this.save('exr'));
    button('copy-link').addEventListener('click', () => void this.copy(button('copy-link'), this.link()));
    button('copy-command').addEventListener('click', () => void this.copy(button('copy-command'), this.command()));
    const fullscreen = button('fullscreen');
    fullscreen.hidden = !document.fullscreenEnabled;
    fullscreen.addEventListener('click', () => void toggleFullscreen().catch((error: unknown) => showError({ code: 'FULLSCREEN', message: (error as Error).message })));
    document.addEventListener('fullscreenchange', () => fullscreen.setAttribute('aria-pressed', String(document.fullscreenElement !== null)));
    const help = byId('help', HTMLDialogElement);
    button('keys').addEventListener('click', () => help.showModal());
    button('fold').addEventListener('click', () => this.fold());
    addEventListener('keydown', (event) => this.shortcut(event));
  }

  private shortcut(event: KeyboardEvent): void {
    const typing = event.target instanceof Element && event.target.closest('a, button, dialog, input, select, summary');
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const buttons: Record<string, string> = { ' ': 'pause', '.': 'step', r: 'reset', c: 'compare', f: 'fullscreen', h: 'fold', i: 'inspect', p: 'play', t: 'dissect', '?': 'keys' };
    if (/^[1-9]$/.test(event.key)) return this.cameras.goTo(Number(event.key));
    if (event.key === 'x') return this.compare.flip();
    const id = buttons[event.key];
    if (!id) return;
    event.preventDefault();
    button(id).click();
  }

  /** A second picture begins as a copy of the first; what is changed next is changed in it. */
  private async openCompare(): Promise<void> {
    await this.compare.open();
    this.edit('b');
  }

  private edit(side: string): void {
    this.edited = (side === 'b' && this.compare.other) || this.view;
    menu('target').value = this.edited === this.view ? 'a' : 'b';
    this.showMenus();
  }

  private showCompare(change?: Change): void {
    const { other } = this.compare;
    byId('target-row', HTMLElement).hidden = !other;
    button('compare').setAttribute('aria-pressed', String(other !== undefined));
    if (!other && this.edited !== this.view) this.edit('a');
    this.meter?.compareWith(other);
    this.difference?.update();
    if (change) this.noteChange(change);
    else this.address.chosen();
  }

  private viewers(): RestirViewer[] {
    return [this.view, ...(this.compare.other ? [this.compare.other] : [])];
  }

  private async openGallery(): Promise<void> {
    const { openGallery } = await import('./gallery.js');
    const show = (scene: string) => void this.settle(this.view.load(scene));
    openGallery(this.description?.scenes ?? [], this.view.settings.scene, { show, pick: () => byId('file', HTMLInputElement).click() });
  }

  private pause(paused: boolean): void {
    for (const view of this.viewers()) {
      if (paused) view.pause();
      else view.play();
    }
    button('pause').setAttribute('aria-pressed', String(paused));
  }

  private fold(): void {
    const settings = byId('settings', HTMLElement);
    settings.hidden = !settings.hidden;
    byId('side', HTMLElement).classList.toggle('folded', settings.hidden);
    button('fold').setAttribute('aria-expanded', String(!settings.hidden));
  }

  private async save(type: 'png' | 'exr'): Promise<void> {
    const picture = await this.view.capture({ type }).catch(() => undefined);
    if (picture) save(picture, `${this.fileName()}.${type}`);
  }

  /** What pictures are called, without an ending. */
  private fileName(): string {
    return `${(this.view.scene?.source.name ?? 'restir').replace(/[^\w.-]+/g, '-')}-${this.view.settings.technique}`;
  }

  private link(): string {
    const url = new URL(this.view.shareUrl(location.href));
    const second = this.compare.query;
    if (second !== undefined) url.search += `${url.search ? '&' : '?'}b=${encodeURIComponent(second)}`;
    return url.href;
  }

  private command(): string {
    const { view } = this;
    return commandLine(view.settings, view.scene?.source.name ?? '', this.moment, this.size, this.frames);
  }

  /** Copies text, and says on the button that it has, or what went wrong. */
  private async copy(from: HTMLButtonElement, text: string): Promise<void> {
    try {
      await navigator.clipboard.writeText(text);
    } catch (error) {
      return showError({ code: 'CLIPBOARD', message: `${text} (${(error as Error).message})` });
    }
    const label = (from.dataset.label ??= from.textContent ?? '');
    from.textContent = 'Copied';
    setTimeout(() => (from.textContent = label), 1500);
  }

  // Frames

  private showSample(sample: Sample): void {
    performance.mark('picture');
    // A frame of the former scene ends no load.
    if (!this.view.opening) hideProgress();
    this.time.showTime(sample.time);
    const { count: frames, milliseconds, width, height, complete } = sample;
    [this.size, this.frames, this.moment] = [[width, height], frames, sample.time];
    const show = () => {
      const adapter = this.view.scene?.report.adapter ?? '';
      showStatus({ frames, milliseconds, size: [width, height], adapter, stats: this.stats });
    };
    show();
    const now = performance.now();
    if (now - this.statsTime < statsInterval && !complete) return;
    this.statsTime = now;
    const read = async () => {
      this.stats = await this.view.timings();
      show();
      showTiming(this.stats);
      this.history.add({ ...this.stats, milliseconds });
    };
    // A frame that was not measured is no loss.
    read().catch(() => undefined);
  }
}

const app = new App();

declare global {
  interface Window {
    /** For the console and the tests: runs work on the viewer between two frames. */
    restir?: { call: RestirViewer['call']; other: RestirViewer['call'] };
  }
}
window.restir = {
  call: (work) => app.view.call(work),
  other: (work) => app.compare.other?.call(work) ?? Promise.reject(new Error('there is no second picture')),
};

// What nobody has foreseen is not silent either.
addEventListener('error', ({ error, message }) => showError(error ?? { code: 'INTERNAL', message }));
addEventListener('unhandledrejection', ({ reason }) => showError(reason));

void app.open();
