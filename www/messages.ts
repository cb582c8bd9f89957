// From an error to words: what happened, and what can be done about it.
import type { Failure } from './api.js';

export interface Explanation {
  title: string;
  text: string;
  advice: string;
}

const known: Record<string, { title: string; advice: string }> = {
  NO_WEBGPU: {
    title: 'This browser has no WebGPU',
    advice:
      'Use a current Chrome, Edge, Safari or Firefox, over https or on localhost. On Linux, Chrome may need chrome://flags/#enable-unsafe-webgpu and Firefox dom.webgpu.enabled in about:config.',
  },
  NO_ADAPTER: {
    title: 'No graphics adapter was found',
    advice: 'Turn on hardware acceleration in the browser settings, update the graphics driver, then restart the browser.',
  },
  LIMIT: {
    title: 'This graphics adapter is too small for that',
    advice: 'Choose a smaller scene or a lower resolution scale.',
  },
  DEVICE: {
    title: 'The graphics device was lost',
    advice: 'The driver was reset, or ran out of memory. Restart; if it happens again, lower the resolution scale.',
  },
  SHADER: { title: 'A shader does not compile here', advice: 'This is a fault of restir: please report it with the text above.' },
  FULLSCREEN: { title: 'The browser does not let the page fill the screen', advice: 'In a frame of another page, that page has to allow it (allow="fullscreen").' },
  CLIPBOARD: { title: 'The browser does not let the page copy', advice: 'Copy the text above by hand.' },
  NO_RECORDER: { title: 'This browser records no video', advice: 'Save the pictures one by one, or use a current Chrome, Edge or Firefox.' },
  STORAGE: { title: 'The browser keeps nothing for this page', advice: 'Allow the page to store data, or copy a link to the picture.' },
  BAD_FILE: { title: 'This file is broken', advice: 'Export it again. What is wrong with a glTF file the Khronos glTF validator tells in full.' },
  UNSUPPORTED: { title: 'This file needs something restir does not have', advice: 'Export it without that extension.' },
  UNKNOWN_NAME: { title: 'Unknown name', advice: 'Choose one from the menus.' },
  BAD_VALUE: { title: 'A value is out of range', advice: 'The former value stays.' },
  IO: { title: 'A file could not be read', advice: 'Check the connection and the file, then try again.' },
  WORKER: { title: 'Loading stopped', advice: 'Reload the page; if the scene is large, try a smaller one.' },
  NOT_A_SCENE: { title: 'This is not a scene', advice: 'Drop a .glb or .restir file, or a .gltf or .obj together with the files that it names. An environment map is an .hdr or .exr file.' },
};

/** A failure as what a promise rejects with. */
export class RestirError extends Error {
  /** Stable: one of the keys of `known` above, `CANCELLED`, `DISPOSED` or `INTERNAL`. */
  readonly code: string;

  constructor({ code, message }: Failure) {
    super(message);
    this.name = 'RestirError';
    this.code = code;
  }
}

/** Any thrown value as a `Failure`. */
export function toFailure(error: unknown): Failure {
  if (typeof error === 'object' && error !== null && 'message' in error) {
    const code = 'code' in error && typeof error.code === 'string' ? error.code : 'INTERNAL';
    return { code, message: String(error.message) };
  }
  return { code: 'INTERNAL', message: String(error) };
}

/** The words for an error. */
export function explain(error: unknown): Explanation {
  const { code, message } = toFailure(error);
  const { title, advice } = known[code] ?? { title: 'Something went wrong', advice: 'Reload the page. If it happens again, please report it with the text above.' };
  return { title, text: message, advice };
}
