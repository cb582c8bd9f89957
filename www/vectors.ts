// Arithmetic of vectors and colours.
import type { Vector } from './api.js';

export const add = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const scale = (a: Vector, s: number): Vector => [a[0] * s, a[1] * s, a[2] * s];
export const subtract = (a: Vector, b: Vector): Vector => add(a, scale(b, -1));
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vector): number => Math.sqrt(dot(a, a));
/** Of length 1; zero stays zero. */
export const normalize = (a: Vector): Vector => scale(a, 1 / (length(a) || 1));

/** Of a linear Rec. 709 colour. */
export const luminance = (color: Vector): number => dot(color, [0.2126, 0.7152, 0.0722]);
