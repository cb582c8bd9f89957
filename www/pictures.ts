// Pictures read from the renderer, and made into files.
import { description } from './description.js';
import type { ExrPicture } from './exr.js';
import type { Viewer } from './pkg/restir.js';
import type { Settings } from './url-state.js';

/** What is displayed, of so many pixels. */
export async function readDisplay(viewer: Viewer, [width, height]: [number, number]): Promise<ImageData> {
  const bytes = (await viewer.read_display()) as Uint8Array;
  return new ImageData(Uint8ClampedArray.from(bytes), width, height);
}

/** Linear radiance and first surfaces, with how they were made, as an OpenEXR file holds them. */
export async function readChannels(viewer: Viewer, [width, height]: [number, number], { seed, technique }: Settings): Promise<ExrPicture> {
  const attributes = {
    'restir.frames': String(viewer.frames()),
    'restir.parameters': viewer.parameters(),
    'restir.seed': String(seed),
    'restir.technique': technique,
    'restir.version': description().version,
  };
  const pixels = (await viewer.read_picture()) as Float32Array;
  const part = async (which: number) => new Float32Array(((await viewer.read_surfaces(which)) as Uint8Array).buffer);
  const [albedoDepth, normal, motion] = [await part(0), await part(1), await part(2)];
  return { width, height, pixels, albedoDepth, normal, motion, attributes };
}

/** A PNG file of a picture. */
export function pngOf(picture: ImageData): Promise<Blob> {
  const canvas = new OffscreenCanvas(picture.width, picture.height);
  canvas.getContext('2d')?.putImageData(picture, 0, 0);
  return canvas.convertToBlob({ type: 'image/png' });
}
