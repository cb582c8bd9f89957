// Compares two pictures, off the page's thread.
import { type MeasureReply, type MeasureRequest } from './measure.js';
import { toFailure } from './messages.js';
import init, { measure_errors, measure_flip } from './pkg/restir.js';

self.onmessage = async ({ data }: MessageEvent<MeasureRequest>) => {
  const { id, module, kind, picture, reference, width } = data;
  const reply = (message: MeasureReply) => self.postMessage(message);
  try {
    await init({ module_or_path: module });
    const map = measure_flip(picture, reference, width);
    const flip = map.reduce((sum, value) => sum + value, 0) / map.length;
    reply({ id, result: kind === 'flip' ? map : { ...JSON.parse(measure_errors(picture, reference, width)), flip } });
  } catch (error) {
    reply({ id, failure: toFailure(error) });
  }
};
