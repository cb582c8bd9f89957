// Decodes the PNG files that `restir render` writes: 8 bits a channel, RGB or RGBA, not interlaced.
import { inflateSync } from 'node:zlib';

const channelsOf = { 2: 3, 6: 4 };

function paeth(left, up, corner) {
  const [a, b, c] = [left, up, corner].map((value) => Math.abs(left + up - corner - value));
  return a <= b && a <= c ? left : b <= c ? up : corner;
}

/** What each of the five filters adds, from the bytes to the left, above, and above to the left. */
const predictors = [() => 0, (left) => left, (_, up) => up, (left, up) => (left + up) >> 1, paeth];

/** Returns width, height and `rgb`: three bytes a pixel, row-major from the top. */
export function decodePng(file) {
  const [width, height, depth, type] = [file.readUInt32BE(16), file.readUInt32BE(20), file[24], file[25]];
  const channels = channelsOf[type];
  if (depth !== 8 || !channels || file[28] !== 0) throw new Error(`unexpected PNG: depth ${depth}, colour type ${type}`);
  const chunks = [];
  for (let at = 8; at < file.length; at += 12 + file.readUInt32BE(at)) {
    if (file.toString('latin1', at + 4, at + 8) === 'IDAT') chunks.push(file.subarray(at + 8, at + 8 + file.readUInt32BE(at)));
  }
  const raw = inflateSync(Buffer.concat(chunks));
  const stride = width * channels;
  const rgb = new Uint8Array(width * height * 3);
  let above = new Uint8Array(stride);
  for (let y = 0; y < height; y++) {
    const start = y * (stride + 1);
    const predict = predictors[raw[start]];
    const row = raw.slice(start + 1, start + 1 + stride);
    for (let x = 0; x < stride; x++) row[x] += predict(row[x - channels] ?? 0, above[x], above[x - channels] ?? 0);
    for (let x = 0; x < width; x++) rgb.set(row.subarray(x * channels, x * channels + 3), (y * width + x) * 3);
    above = row;
  }
  return { width, height, rgb };
}
