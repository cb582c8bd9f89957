// What lies over the picture, in its pixels: lines and marks of the inspector, pictures of passes.
import type { Camera, Vector } from './api.js';
import { cross, dot, normalize, subtract } from './vectors.js';

/** Where a picture of `size` pixels lies in the canvas that shows it whole (object-fit: contain), in CSS pixels of the page. */
export function shownAt(canvas: HTMLCanvasElement, [width, height]: [number, number]): { left: number; top: number; scale: number } {
  const box = canvas.getBoundingClientRect();
  const scale = Math.min(box.width / width, box.height / height);
  return { left: box.left + (box.width - width * scale) / 2, top: box.top + (box.height - height * scale) / 2, scale };
}

/** The pixel under a point of the page; undefined beside the picture. */
export function pixelAt(canvas: HTMLCanvasElement, size: [number, number], x: number, y: number): [number, number] | undefined {
  const { left, top, scale } = shownAt(canvas, size);
  const pixel: [number, number] = [Math.floor((x - left) / scale), Math.floor((y - top) / scale)];
  return pixel.every((value, at) => value >= 0 && value < (size[at] ?? 0)) ? pixel : undefined;
}

/**
 * The part of a line in world space that lies before the camera, as two points in pixels of a picture of `size`; undefined where all of
 * it lies behind.
 */
export function projectLine(camera: Camera, size: [number, number], from: Vector, to: Vector): [[number, number], [number, number]] | undefined {
  const forward = normalize(camera.forward);
  const right = normalize(cross(forward, camera.up));
  const up = cross(right, forward);
  const [width, height] = size;
  const flat = camera.half_height !== undefined;
  const halfHeight = camera.half_height ?? Math.tan((camera.vertical_fov ?? 0.8) / 2);
  const inView = (point: Vector): Vector => {
    const offset = subtract(point, camera.position);
    return [dot(offset, right), dot(offset, up), dot(offset, forward)];
  };
  let [a, b] = [inView(from), inView(to)];
  if (!flat) {
    const near = 1e-3 * Math.max(Math.abs(a[2]), Math.abs(b[2]), 1e-6);
    if (a[2] < near && b[2] < near) return undefined;
    const cut = (inside: Vector, outside: Vector): Vector => {
      const t = (inside[2] - near) / (inside[2] - outside[2]);
      return inside.map((value, at) => value + t * ((outside[at] ?? 0) - value)) as Vector;
    };
    if (a[2] < near) a = cut(b, a);
    else if (b[2] < near) b = cut(a, b);
  }
  const place = ([x, y, z]: Vector): [number, number] => {
    const w = halfHeight * (flat ? 1 : z);
    return [width / 2 + ((x / w) * height) / 2, height / 2 - ((y / w) * height) / 2];
  };
  return [place(a), place(b)];
}
