// A camera that orbits, pans, zooms and flies. Pure arithmetic: no events, no page.
import type { Camera, Vector } from './api.js';
import { add, cross, dot, length, normalize, scale, subtract } from './vectors.js';

/** Rotates `a` about the unit `axis` by `angle` radians, counter-clockwise as seen from its tip (Rodrigues' formula). */
function rotate(a: Vector, axis: Vector, angle: number): Vector {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scale(a, c), scale(cross(axis, a), s)), scale(axis, dot(axis, a) * (1 - c)));
}

const worldUp: Vector = [0, 1, 0];

/** Camera pose with a pivot `distance` in front of it. Changes are in radians and in fractions of the view's height. */
export class OrbitCamera {
  private position: Vector = [0, 0, 1];
  private forward: Vector = [0, 0, -1];
  private up: Vector = worldUp;
  private lens: Pick<Camera, 'vertical_fov' | 'half_height'> = { vertical_fov: 0.8 };
  private distance = 1;
  /** Half the diagonal of the scene's bounds: the unit of flying speed and of the zoom's ends. */
  private radius = 1;

  /** Takes over `camera`. The pivot lies on its axis, as near as may be to the middle of `bounds` (min xyz, max xyz). */
  set(camera: Camera, bounds: ArrayLike<number>): void {
    const corner = (at: number): Vector => [bounds[at] ?? 0, bounds[at + 1] ?? 0, bounds[at + 2] ?? 0];
    const [low, high] = [corner(0), corner(3)];
    this.radius = length(subtract(high, low)) / 2 || 1;
    this.position = camera.position;
    this.forward = normalize(camera.forward);
    this.up = normalize(cross(cross(this.forward, camera.up), this.forward));
    this.lens = camera.half_height === undefined ? { vertical_fov: camera.vertical_fov ?? 0.8 } : { half_height: camera.half_height };
    const toMiddle = dot(subtract(scale(add(low, high), 0.5), this.position), this.forward);
    this.distance = Math.max(toMiddle, this.radius * 0.05);
  }

  /** Turns to a point, which becomes the pivot. */
  focus(point: Vector): void {
    const away = subtract(point, this.position);
    const right = cross(normalize(away), this.up);
    // Straight above or below, no direction is to the right.
    if (length(right) < 1e-3) return;
    this.forward = normalize(away);
    this.up = normalize(cross(right, this.forward));
    this.distance = this.clampDistance(length(away));
  }

  toCamera(): Camera {
    return { position: this.position, forward: this.forward, up: this.up, ...this.lens };
  }

  /** Turns round the pivot. */
  orbit(yaw: number, pitch: number): void {
    const pivot = this.pivot();
    this.turn(yaw, pitch);
    this.position = subtract(pivot, scale(this.forward, this.distance));
  }

  /** Looks around from where it stands. */
  look(yaw: number, pitch: number): void {
    this.turn(yaw, pitch);
  }

  /** Moves sideways so that the pivot follows a pointer that moved by (x, y) view heights, y down. */
  pan(x: number, y: number): void {
    const height = 2 * (this.lens.half_height ?? this.distance * Math.tan((this.lens.vertical_fov ?? 0.8) / 2));
    this.position = add(this.position, add(scale(this.right(), -x * height), scale(this.up, y * height)));
  }

  /** Multiplies the distance to the pivot (or an orthographic view's height) by `factor`. */
  zoom(factor: number): void {
    if (this.lens.half_height !== undefined) {
      this.lens = { half_height: this.clampDistance(this.lens.half_height * factor) };
      return;
    }
    const pivot = this.pivot();
    this.distance = this.clampDistance(this.distance * factor);
    this.position = subtract(pivot, scale(this.forward, this.distance));
  }

  /** Moves by scene radii to the right, along the world's up and forward. */
  fly(right: number, up: number, forward: number): void {
    const step = add(add(scale(this.right(), right), scale(worldUp, up)), scale(this.forward, forward));
    this.position = add(this.position, scale(step, this.radius));
  }

  private right(): Vector {
    return normalize(cross(this.forward, this.up));
  }

  private pivot(): Vector {
    return add(this.position, scale(this.forward, this.distance));
  }

  private clampDistance(value: number): number {
    return Math.min(Math.max(value, this.radius * 1e-3), this.radius * 50);
  }

  private turn(yaw: number, pitch: number): void {
    const right = this.right();
    const up = rotate(this.up, right, pitch);
    // Over the pole the picture would stand on its head: stop there, unless it does already.
    const tips = dot(up, worldUp) < 0.02 && dot(up, worldUp) < dot(this.up, worldUp);
    if (!tips) {
      this.forward = rotate(this.forward, right, pitch);
      this.up = up;
    }
    this.forward = normalize(rotate(this.forward, worldUp, yaw));
    this.up = normalize(rotate(this.up, worldUp, yaw));
  }
}
