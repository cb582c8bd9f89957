// Writes zip archives: files one after another, not compressed, for pictures are already.

export interface ZipEntry {
  /** Without folders; plain ASCII. */
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
}

/** Remainders of the CRC-32 of PKZIP, for each value of a byte. */
const remainders = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

function crc32(bytes: Uint8Array): number {
  let value = 0xffffffff;
  for (const byte of bytes) value = (value >>> 8) ^ (remainders[(value ^ byte) & 0xff] ?? 0);
  return ~value >>> 0;
}

/** Numbers of two or four bytes, little-endian, one after another. */
function record(...fields: [bytes: 2 | 4, value: number][]): Uint8Array<ArrayBuffer> {
  const view = new DataView(new ArrayBuffer(fields.reduce((sum, [bytes]) => sum + bytes, 0)));
  let at = 0;
  for (const [bytes, value] of fields) {
    if (bytes === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
    at += bytes;
  }
  return new Uint8Array(view.buffer);
}

/** Midnight of the first of January 1980, the zero of the format's calendar: the same files give the same archive. */
const [time, date] = [0, 0x21];

/** An archive of `entries` (APPNOTE.TXT 4.3). Throws LIMIT where it would need the format's larger variant: from 4 GB or 65536 files. */
export function zip(entries: readonly ZipEntry[]): Blob {
  const [parts, directory]: [BlobPart[], BlobPart[]] = [[], []];
  let [offset, directorySize] = [0, 0];
  for (const { name, bytes } of entries) {
    const text = new TextEncoder().encode(name);
    // Version 1.0, no flags, not compressed.
    const common: [2 | 4, number][] = [[2, 10], [2, 0], [2, 0], [2, time], [2, date], [4, crc32(bytes)], [4, bytes.length], [4, bytes.length], [2, text.length], [2, 0]];
    const local = record([4, 0x04034b50], ...common);
    const central = record([4, 0x02014b50], [2, 10], ...common, [2, 0], [2, 0], [2, 0], [4, 0], [4, offset]);
    parts.push(local, text, bytes);
    directory.push(central, text);
    offset += local.length + text.length + bytes.length;
    directorySize += central.length + text.length;
  }
  const count = entries.length;
  if (count > 0xffff || offset + directorySize > 0xffffffff) throw { code: 'LIMIT', message: `${count} pictures are too many or too large for one zip file.` };
  const end = record([4, 0x06054b50], [2, 0], [2, 0], [2, count], [2, count], [4, directorySize], [4, offset], [2, 0]);
  return new Blob([...parts, ...directory, end], { type: 'application/zip' });
}
