// Mouse, keyboard and touch to camera movements.
import type { OrbitCamera } from './camera.js';

/** Radians for a drag over the whole height of the canvas. */
const turnPerHeight = 3;
/** Scene radii per second. */
const flySpeed = 0.6;
/** Radians per second of the arrow keys. */
const turnSpeed = 1.5;
/** Seconds that a key counts for at least: one that is tapped between two frames moves the camera, too. */
const tap = 0.05;

const flyKeys: Record<string, [number, number, number]> = {
  KeyW: [0, 0, 1],
  KeyS: [0, 0, -1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyE: [0, 1, 0],
  KeyQ: [0, -1, 0],
};
const turnKeys: Record<string, [number, number]> = {
  ArrowLeft: [1, 0],
  ArrowRight: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
const zoomKeys: Record<string, number> = { Equal: -1, NumpadAdd: -1, Minus: 1, NumpadSubtract: 1 };

export class Controls {
  /** A drag orbits the pivot, or (fly) looks around. */
  mode: 'orbit' | 'fly' = 'orbit';
  private readonly pointers = new Map<number, { x: number; y: number }>();
  private readonly pressed = new Set<string>();
  /** Pressed since the last frame, whether or not they still are. */
  private readonly tapped = new Set<string>();
  private moved = false;
  private fast = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: OrbitCamera,
    /** Ends listening when it is aborted. */
    signal: AbortSignal,
  ) {
    const listen = <Type extends keyof HTMLElementEventMap>(type: Type, heard: (event: HTMLElementEventMap[Type]) => void) =>
      canvas.addEventListener(type, heard, { signal, passive: false });
    listen('pointerdown', (event) => this.down(event));
    listen('pointermove', (event) => this.drag(event));
    for (const type of ['pointerup', 'pointercancel'] as const) listen(type, (event) => this.pointers.delete(event.pointerId));
    listen('contextmenu', (event) => event.preventDefault());
    listen('wheel', (event) => this.wheel(event));
    listen('keydown', (event) => this.key(event, true));
    listen('keyup', (event) => this.key(event, false));
    listen('blur', () => this.pressed.clear());
  }

  /** Applies held keys over `seconds`; returns whether the camera moved since the last call. */
  update(seconds: number): boolean {
    for (const code of new Set([...this.pressed, ...this.tapped])) {
      const speed = (this.tapped.has(code) ? Math.max(seconds, tap) : seconds) * (this.fast ? 4 : 1);
      const [fly, turn, zoom] = [flyKeys[code], turnKeys[code], zoomKeys[code]];
      if (fly) this.camera.fly(fly[0] * speed * flySpeed, fly[1] * speed * flySpeed, fly[2] * speed * flySpeed);
      if (turn) this.turn(turn[0] * speed * turnSpeed, turn[1] * speed * turnSpeed);
      if (zoom) this.camera.zoom(Math.exp(zoom * speed));
      this.moved = true;
    }
    this.tapped.clear();
    const moved = this.moved;
    this.moved = false;
    return moved;
  }

  private turn(yaw: number, pitch: number): void {
    if (this.mode === 'fly') this.camera.look(yaw, pitch);
    else this.camera.orbit(yaw, pitch);
  }

  private down(event: PointerEvent): void {
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  private drag(event: PointerEvent): void {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const height = this.canvas.clientHeight || 1;
    const [x, y] = [(event.clientX - last.x) / height, (event.clientY - last.y) / height];
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      // Two fingers: their distance zooms, their middle pans.
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 0 && after > 0) this.camera.zoom(before / after);
      this.camera.pan(x / 2, y / 2);
    } else if (event.buttons & 6 || event.shiftKey) {
      this.camera.pan(x, y);
    } else {
      this.turn(-x * turnPerHeight, -y * turnPerHeight);
    }
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.moved = true;
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    // deltaMode 1 counts lines, 0 pixels.
    const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
    this.camera.zoom(Math.exp(Math.max(-200, Math.min(200, pixels)) * 0.0015));
    this.moved = true;
  }

  private key(event: KeyboardEvent, isDown: boolean): void {
    this.fast = event.shiftKey;
    const known = event.code in flyKeys || event.code in turnKeys || event.code in zoomKeys;
    if (!isDown) this.pressed.delete(event.code);
    if (!known || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!isDown) return;
    this.pressed.add(event.code);
    if (!event.repeat) this.tapped.add(event.code);
  }
}
