// The controls of scene time: play and pause, scrub, speed, and which animation is played.
import type { SceneReport } from './api.js';
import { byId } from './notices.js';
import { fillMenu } from './panel.js';

export interface TimeEvents {
  /** Time shall run, or stand still. */
  play(on: boolean): void;
  /** The picture shall show this moment. Resolves when it is the viewer's. */
  seek(seconds: number): Promise<void>;
  /** Time shall run this many times as fast. */
  speed(factor: number): void;
  /** Another animation shall be played, by its index. */
  animation(index: string): void;
}

/** The row of time controls; hidden for a scene in which nothing moves. */
export class TimeControls {
  private readonly row = byId('time', HTMLElement);
  private readonly button = byId('play', HTMLButtonElement);
  private readonly scrub = byId('scrub', HTMLInputElement);
  private readonly text = byId('moment', HTMLElement);
  private readonly speedMenu = byId('speed', HTMLSelectElement);
  private readonly animations = byId('animation', HTMLSelectElement);
  private report: SceneReport | undefined;
  private playing = false;
  /** Moments asked for that the viewer has not taken yet. */
  private seeking = 0;

  constructor(events: TimeEvents) {
    this.button.addEventListener('click', () => events.play(!this.playing));
    this.scrub.addEventListener('input', () => {
      this.seeking += 1;
      void events.seek(Number(this.scrub.value)).finally(() => (this.seeking -= 1));
      this.showMoment(Number(this.scrub.value));
    });
    this.speedMenu.addEventListener('change', () => events.speed(Number(this.speedMenu.value)));
    this.animations.addEventListener('change', () => {
      this.showDuration();
      events.animation(this.animations.value);
    });
  }

  /** Shows what a scene has, with animation `chosen` at `speed`. */
  open(report: SceneReport, chosen: number, speed: number): void {
    this.report = report;
    this.row.hidden = !report.animated;
    const names = report.animations.map(({ name }, index): [string, string] => [String(index), name]);
    fillMenu(this.animations, names.length > 0 ? names : [['0', 'everything']], String(chosen));
    this.animations.disabled = names.length < 2;
    const speeds = [...this.speedMenu.options].map(({ value, text }): [string, string] => [value, text]);
    fillMenu(this.speedMenu, speeds, String(speed));
    this.showDuration();
  }

  /** Shows whether time runs. */
  showPlaying(playing: boolean): void {
    this.playing = playing;
    this.button.setAttribute('aria-pressed', String(playing));
    this.button.textContent = playing ? 'Stop time' : 'Play';
  }

  /**
   * Shows the moment of the last frame. Nothing is written while the user holds the slider, or while a frame from before the last
   * step of the slider is finished: the next step would start from there.
   */
  showTime(seconds: number): void {
    if (this.row.hidden || this.seeking > 0 || this.scrub.matches(':active')) return;
    const duration = this.duration();
    // The end of a loop is shown as its end, not as the start of the next.
    const moment = seconds >= 0 && seconds <= duration ? seconds : seconds - Math.floor(seconds / duration) * duration;
    this.scrub.value = String(moment);
    this.showMoment(moment);
  }

  private duration(): number {
    const chosen = this.report?.animations[Number(this.animations.value)];
    return (chosen?.seconds ?? this.report?.seconds) || 1;
  }

  private showDuration(): void {
    this.scrub.max = String(this.duration());
    this.showMoment(Number(this.scrub.value));
  }

  private showMoment(seconds: number): void {
    this.text.textContent = `${seconds.toFixed(2)} s`;
    this.scrub.setAttribute('aria-valuetext', `${seconds.toFixed(2)} of ${this.duration().toFixed(2)} seconds`);
  }
}
