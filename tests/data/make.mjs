// Makes the compressed files of this folder with the reference encoders, and beside each what the reference decoder makes
// of it. Run by hand, when a file is to be added:
//
//   npm install --no-save draco3d@1.5.7 meshoptimizer@1.3.0 ktx2-encoder@0.6.0
//   pip install pillow==12.0.0
//   node tests/data/make.mjs
import { execFileSync } from 'node:child_process';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateSync, crc32 } from 'node:zlib';

const here = fileURLToPath(new URL('.', import.meta.url));
// Beside the modules that are imported, wherever npm put them.
const require = createRequire(join(process.cwd(), 'any.js'));
const save = (name, bytes) => (writeFileSync(join(here, name), bytes), console.log(name, bytes.length));
const bytesOf = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
const base64 = (bytes) => Buffer.from(bytes).toString('base64');

// A wavy sheet of 9 x 7 vertices: positions, unit normals, texture coordinates, colours, triangles.
const [columns, rows] = [9, 7];
const sheet = { position: [], normal: [], uv: [], color: [], index: [] };
for (let y = 0; y < rows; y++) {
  for (let x = 0; x < columns; x++) {
    const [u, v] = [x / (columns - 1), y / (rows - 1)];
    const height = 0.2 * Math.sin(6 * u) * Math.cos(4 * v);
    sheet.position.push(2 * u - 1, height, 2 * v - 1);
    const normal = [-0.6 * Math.cos(6 * u) * Math.cos(4 * v), 1, 0.4 * Math.sin(6 * u) * Math.sin(4 * v)];
    const length = Math.hypot(...normal);
    sheet.normal.push(...normal.map((value) => value / length));
    sheet.uv.push(u, v);
    sheet.color.push(Math.round(255 * u), Math.round(255 * v), 128, 255);
    if (x + 1 < columns && y + 1 < rows) {
      const corner = y * columns + x;
      sheet.index.push(corner, corner + columns, corner + 1, corner + 1, corner + columns, corner + columns + 1);
    }
  }
}
const vertices = columns * rows;

// Draco: one file a method, and the attributes and triangles that Google's decoder gives.
async function draco() {
  const { createEncoderModule, createDecoderModule } = require('draco3d');
  const encoderModule = await createEncoderModule({});
  const decoderModule = await createDecoderModule({});
  const cases = [
    ['edgebreaker', encoderModule.MESH_EDGEBREAKER_ENCODING, 5],
    ['valence', encoderModule.MESH_EDGEBREAKER_ENCODING, 0],
    ['sequential', encoderModule.MESH_SEQUENTIAL_ENCODING, 10],
  ];
  const out = [];
  for (const [name, method, speed] of cases) {
    const encoder = new encoderModule.Encoder();
    const builder = new encoderModule.MeshBuilder();
    const mesh = new encoderModule.Mesh();
    builder.AddFacesToMesh(mesh, sheet.index.length / 3, new Uint32Array(sheet.index));
    const ids = {
      POSITION: builder.AddFloatAttributeToMesh(mesh, encoderModule.POSITION, vertices, 3, new Float32Array(sheet.position)),
      NORMAL: builder.AddFloatAttributeToMesh(mesh, encoderModule.NORMAL, vertices, 3, new Float32Array(sheet.normal)),
      TEXCOORD_0: builder.AddFloatAttributeToMesh(mesh, encoderModule.TEX_COORD, vertices, 2, new Float32Array(sheet.uv)),
      COLOR_0: builder.AddUInt8Attribute(mesh, encoderModule.COLOR, vertices, 4, new Uint8Array(sheet.color)),
    };
    encoder.SetEncodingMethod(method);
    encoder.SetSpeedOptions(speed, speed);
    encoder.SetAttributeQuantization(encoderModule.POSITION, 11);
    encoder.SetAttributeQuantization(encoderModule.NORMAL, 8);
    encoder.SetAttributeQuantization(encoderModule.TEX_COORD, 10);
    const encoded = new encoderModule.DracoInt8Array();
    const size = encoder.EncodeMeshToDracoBuffer(mesh, encoded);
    const bytes = Uint8Array.from({ length: size }, (_, i) => encoded.GetValue(i) & 255);

    const decoder = new decoderModule.Decoder();
    const buffer = new decoderModule.DecoderBuffer();
    buffer.Init(new Int8Array(bytes), bytes.length);
    const decoded = new decoderModule.Mesh();
    if (!decoder.DecodeBufferToMesh(buffer, decoded).ok()) throw new Error(name);
    const count = decoded.num_points();
    const read = (id, width, type, array) => {
      const attribute = decoder.GetAttributeByUniqueId(decoded, id);
      const values = new array(count * width);
      const pointer = decoderModule._malloc(values.byteLength);
      decoder.GetAttributeDataArrayForAllPoints(decoded, attribute, type, values.byteLength, pointer);
      bytesOf(values).set(new Uint8Array(decoderModule.HEAPU8.buffer, pointer, values.byteLength));
      return base64(bytesOf(values));
    };
    const indices = new Uint32Array(decoded.num_faces() * 3);
    const face = new decoderModule.DracoInt32Array();
    for (let i = 0; i < decoded.num_faces(); i++) {
      decoder.GetFaceFromMesh(decoded, i, face);
      for (let corner = 0; corner < 3; corner++) indices[3 * i + corner] = face.GetValue(corner);
    }
    out.push({
      name, ids, vertices: count, encoded: base64(bytes), indices: base64(bytesOf(indices)),
      POSITION: read(ids.POSITION, 3, decoderModule.DT_FLOAT32, Float32Array),
      NORMAL: read(ids.NORMAL, 3, decoderModule.DT_FLOAT32, Float32Array),
      TEXCOORD_0: read(ids.TEXCOORD_0, 2, decoderModule.DT_FLOAT32, Float32Array),
      COLOR_0: read(ids.COLOR_0, 4, decoderModule.DT_UINT8, Uint8Array),
    });
  }
  save('draco.json', Buffer.from(JSON.stringify(out, null, 1)));
}

// meshopt: every mode, filter and version, and what the reference decoder gives.
async function meshopt() {
  const { MeshoptEncoder: encoder, MeshoptDecoder: decoder } = require('meshoptimizer');
  await Promise.all([encoder.ready, decoder.ready]);
  // Numbers that use every width of deltas.
  let state = 1;
  const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  const walk = (count, stride, steps) => {
    const bytes = new Uint8Array(count * stride);
    for (let i = 0; i < count; i++) {
      for (let byte = 0; byte < stride; byte++) {
        const step = steps[(byte + (i >> 6)) % steps.length];
        bytes[i * stride + byte] = (i > 0 ? bytes[(i - 1) * stride + byte] : 0) + Math.floor(random() * (2 * step + 1)) - step;
      }
    }
    return bytes;
  };
  const positions = new Float32Array(sheet.position);
  const quads = (values, width) => {
    const out = new Float32Array(vertices * 4);
    for (let i = 0; i < vertices; i++) for (let c = 0; c < 4; c++) out[4 * i + c] = c < width ? values[width * i + c] : c === 3 ? 1 : 0;
    return out;
  };
  const unit = (values) => {
    for (let i = 0; i < values.length; i += 4) {
      const length = Math.hypot(...values.subarray(i, i + 4)) || 1;
      for (let c = 0; c < 4; c++) values[i + c] /= length;
    }
    return values;
  };
  const normals = quads(sheet.normal, 3);
  const colors = Float32Array.from(sheet.color, (value) => value / 255);
  const turns = unit(Float32Array.from({ length: vertices * 4 }, () => random() * 2 - 1));
  const attribute = (name, source, count, stride, version, filter = 'NONE') => ({
    name, mode: 'ATTRIBUTES', filter, count, stride,
    bytes: encoder.encodeGltfBuffer(source, count, stride, 'ATTRIBUTES', version),
  });
  const cases = [];
  for (const version of [0, 1]) {
    cases.push(
      attribute(`floats v${version}`, bytesOf(positions), vertices, 12, version),
      attribute(`small steps v${version}`, walk(300, 8, [0, 1, 1, 0]), 300, 8, version),
      attribute(`all steps v${version}`, walk(300, 16, [0, 1, 2, 7, 100, 0, 40, 1]), 300, 16, version),
      attribute(`one element v${version}`, walk(1, 4, [9]), 1, 4, version),
      attribute(`octahedral 8 v${version}`, encoder.encodeFilterOct(normals, vertices, 4, 8), vertices, 4, version, 'OCTAHEDRAL'),
      attribute(`octahedral 12 v${version}`, encoder.encodeFilterOct(normals, vertices, 8, 12), vertices, 8, version, 'OCTAHEDRAL'),
      attribute(`quaternion v${version}`, encoder.encodeFilterQuat(turns, vertices, 8, 12), vertices, 8, version, 'QUATERNION'),
      attribute(`exponential v${version}`, encoder.encodeFilterExp(positions, vertices, 12, 15), vertices, 12, version, 'EXPONENTIAL'),
    );
  }
  cases.push(
    attribute('color 8', encoder.encodeFilterColor(colors, vertices, 4, 8), vertices, 4, 1, 'COLOR'),
    attribute('color 12', encoder.encodeFilterColor(colors, vertices, 8, 12), vertices, 8, 1, 'COLOR'),
  );
  const small = new Uint16Array(sheet.index);
  const large = Uint32Array.from({ length: 600 }, () => Math.floor(random() * 200));
  const strip = Uint32Array.from({ length: 100 }, (_, i) => (i % 2 ? 1000 + i : i));
  for (const [name, mode, list] of [['sheet', 'TRIANGLES', small], ['random', 'TRIANGLES', large], ['strip', 'INDICES', strip], ['sheet', 'INDICES', small]]) {
    const stride = list.BYTES_PER_ELEMENT;
    cases.push({ name: `${name} ${mode}`, mode, filter: 'NONE', count: list.length, stride, bytes: encoder.encodeGltfBuffer(bytesOf(list), list.length, stride, mode) });
  }
  const out = cases.map(({ bytes, ...rest }) => {
    const decoded = new Uint8Array(rest.count * rest.stride);
    decoder.decodeGltfBuffer(decoded, rest.count, rest.stride, bytes, rest.mode, rest.filter);
    return { ...rest, encoded: base64(bytes), decoded: base64(decoded) };
  });
  save('meshopt.json', Buffer.from(JSON.stringify(out, null, 1)));
}

// A picture whose sides are no multiples of four, with alpha.
const [width, height] = [22, 14];
const picture = Uint8Array.from({ length: width * height * 4 }, (_, i) => {
  const [x, y, channel] = [Math.floor(i / 4) % width, Math.floor(i / 4 / width), i % 4];
  return Math.round([255 * (x / width), 255 * (y / height), x < 8 !== y < 7 ? 220 : 40, x + y > 20 ? 255 : 90][channel]);
});

function png(rgba) {
  const chunk = (kind, data) => {
    const body = Buffer.concat([Buffer.from(kind), data]);
    const frame = Buffer.alloc(12 + data.length);
    frame.writeUInt32BE(data.length, 0);
    body.copy(frame, 4);
    frame.writeUInt32BE(crc32(body), 8 + data.length);
    return frame;
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, 6, 0, 0, 0], 8);
  const lines = Buffer.alloc(height * (width * 4 + 1));
  for (let y = 0; y < height; y++) lines.set(rgba.subarray(y * width * 4, (y + 1) * width * 4), y * (width * 4 + 1) + 1);
  return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', header), chunk('IDAT', deflateSync(lines)), chunk('IEND', Buffer.alloc(0))]);
}

// KTX2: ETC1S and UASTC, with and without alpha and Zstandard, and what Binomial's transcoder gives.
async function ktx2() {
  const folder = join(process.cwd(), 'node_modules/ktx2-encoder/dist');
  const { encodeToKTX2 } = await import(join(folder, 'node/index.js'));
  const { default: BASIS } = await import(join(folder, 'basis/basis_encoder.js'));
  const basis = await BASIS();
  basis.initializeBasis();
  const opaque = picture.map((value, i) => (i % 4 === 3 ? 255 : value));
  const cases = [
    ['etc1s', opaque, { isUASTC: false }],
    ['etc1s-alpha', picture, { isUASTC: false }],
    ['uastc', picture, { isUASTC: true, needSupercompression: false }],
    ['uastc-zstd', picture, { isUASTC: true, needSupercompression: true }],
  ];
  for (const [name, data, options] of cases) {
    const imageDecoder = async () => ({ data, width, height });
    const file = await encodeToKTX2(data, { ...options, imageDecoder, generateMipmap: true, isPerceptual: true, isSetKTX2SRGBTransferFunc: true });
    save(`${name}.ktx2`, file);
    const opened = new basis.KTX2File(new Uint8Array(file));
    if (!opened.isValid() || !opened.startTranscoding()) throw new Error(name);
    const rgba32 = 13;
    const pixels = new Uint8Array(opened.getImageTranscodedSizeInBytes(0, 0, 0, rgba32));
    if (!opened.transcodeImage(pixels, 0, 0, 0, rgba32, 0, -1, -1)) throw new Error(name);
    save(`${name}.png`, png(pixels));
    opened.close();
  }
}

// WebP, lossy and lossless, and what libwebp gives.
function webp() {
  const folder = mkdtempSync(join(tmpdir(), 'webp-'));
  writeFileSync(join(folder, 'source.png'), png(picture));
  const script = `
from PIL import Image
source = Image.open('${folder}/source.png')
source.save('${here}lossless.webp', lossless=True, exact=True)
source.save('${here}lossy.webp', quality=80)
Image.open('${here}lossy.webp').convert('RGBA').save('${here}lossy.png')
Image.open('${here}lossless.webp').convert('RGBA').save('${here}lossless.png')`;
  execFileSync('python3', ['-c', script], { stdio: 'inherit' });
}

await draco();
await meshopt();
await ktx2();
webp();
