// OpenEXR as the daemon sends it: scan lines, half, float or uint channels, no compression, RLE, ZIPS or ZIP.
// After the format's description, openexr.com/en/latest/OpenEXRFileLayout.html. And a writer without compression.

const MAGIC = 20000630;
const NONE = 0,
  RLE = 1,
  ZIPS = 2,
  ZIP = 3;
const UINT = 0;
export const HALF = 1,
  FLOAT = 2;
const SIZE = [4, 2, 4];
const text = new TextDecoder('latin1');

let inflate = null;

// Has to be awaited before files with ZIP or ZIPS are read; the library is fetched only then.
export const canInflate = () => inflate !== null;
export async function loadInflate() {
  inflate ??= (await import('../vendor/fflate.js')).unzlibSync;
}

// { window: [x0, y0, x1, y1) , display, channels: [{ name, type }], compression, at } of a file's bytes.
export function readHeader(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 12 || view.getInt32(0, true) !== MAGIC) throw new Error('not an EXR file');
  if (view.getInt32(4, true) & 0x1a00) throw new Error('an EXR file of a kind that the page does not read');
  let at = 8;
  const word = () => {
    const end = bytes.indexOf(0, at);
    if (end < 0) throw new Error('an EXR file that ends in its header');
    const name = text.decode(bytes.subarray(at, end));
    at = end + 1;
    return name;
  };
  const box = (from) => [
    view.getInt32(from, true),
    view.getInt32(from + 4, true),
    view.getInt32(from + 8, true) + 1,
    view.getInt32(from + 12, true) + 1,
  ];
  const header = { channels: [], compression: NONE };
  for (let name = word(); name; name = word()) {
    word();
    const size = view.getInt32(at, true);
    at += 4;
    const end = at + size;
    if (name === 'channels') {
      for (let channel = word(); channel; channel = word()) {
        header.channels.push({ name: channel, type: view.getInt32(at, true) });
        at += 16;
      }
    } else if (name === 'compression') {
      header.compression = bytes[at];
    } else if (name === 'dataWindow') {
      header.window = box(at);
    } else if (name === 'displayWindow') {
      header.display = box(at);
    }
    at = end;
  }
  header.at = at;
  return header;
}

// Copies all rows of a file's bytes to planes. plane(name, type) answers { bytes, width } of a channel: its memory, and
// the pixels of a row of it; null: not wanted.
export function readPixels(bytes, header, plane) {
  const [x0, y0, x1, y1] = header.window;
  const lines = header.compression === ZIP ? 16 : 1;
  if (header.compression > ZIP) throw new Error(`EXR compression ${header.compression} is not read here`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const columns = header.channels.map(({ name, type }) => ({
    size: SIZE[type] * (x1 - x0),
    unit: SIZE[type],
    to: type === UINT ? null : plane(name, type),
  }));
  const lineBytes = columns.reduce((sum, column) => sum + column.size, 0);
  let at = header.at + 8 * Math.ceil((y1 - y0) / lines);
  for (let top = y0; top < y1; top += lines) {
    const y = view.getInt32(at, true),
      packed = view.getInt32(at + 4, true);
    const rows = Math.min(lines, y1 - y);
    at += 8;
    let from = bytes,
      offset = at;
    if (header.compression !== NONE && packed < rows * lineBytes) {
      from = unpack(bytes.subarray(at, at + packed), rows * lineBytes, header.compression);
      offset = 0;
    }
    at += packed;
    for (let row = y; row < y + rows; row++) {
      for (const { size, unit, to } of columns) {
        if (to) to.bytes.set(from.subarray(offset, offset + size), (row * to.width + x0) * unit);
        offset += size;
      }
    }
  }
}

let unpacked = new Uint8Array(0),
  woven = new Uint8Array(0);

function unpack(bytes, size, compression) {
  if (woven.length < size) [unpacked, woven] = [new Uint8Array(size), new Uint8Array(size)];
  if (compression === RLE) {
    for (let at = 0, to = 0; at < bytes.length;) {
      const run = (bytes[at++] << 24) >> 24;
      if (run < 0) {
        unpacked.set(bytes.subarray(at, at - run), to);
        at -= run;
        to -= run;
      } else {
        unpacked.fill(bytes[at++], to, (to += run + 1));
      }
    }
  } else {
    if (!inflate) throw new Error('a compressed tile came before the page was ready for it');
    inflate(bytes, { out: unpacked.subarray(0, size) });
  }
  for (let i = 1; i < size; i++) unpacked[i] = unpacked[i - 1] + unpacked[i] - 128;
  const half = (size + 1) >> 1;
  for (let i = 0, j = 0; i < size; j++) {
    woven[i++] = unpacked[j];
    if (i < size) woven[i++] = unpacked[half + j];
  }
  return woven;
}

// A file of one window. channels: [{ name, type, data }], data Uint16Array of halfs or Float32Array, as many pixels a
// row as the window has; in whatever order.
export function writeExr(frameWidth, frameHeight, [x0, y0, x1, y1], channels) {
  const sorted = [...channels].sort((a, b) => (a.name < b.name ? -1 : 1));
  const width = x1 - x0,
    height = y1 - y0;
  const header = [];
  const int = (value) => [value & 255, (value >> 8) & 255, (value >> 16) & 255, (value >> 24) & 255];
  const word = (value) => [...new TextEncoder().encode(value), 0];
  const float = (value) => [...new Uint8Array(new Float32Array([value]).buffer)];
  const attribute = (name, type, value) => header.push(...word(name), ...word(type), ...int(value.length), ...value);
  header.push(...int(MAGIC), ...int(2));
  attribute('channels', 'chlist', [
    ...sorted.flatMap(({ name, type }) => [...word(name), ...int(type), 0, 0, 0, 0, ...int(1), ...int(1)]),
    0,
  ]);
  attribute('compression', 'compression', [NONE]);
  attribute('dataWindow', 'box2i', [x0, y0, x1 - 1, y1 - 1].flatMap(int));
  attribute('displayWindow', 'box2i', [0, 0, frameWidth - 1, frameHeight - 1].flatMap(int));
  attribute('lineOrder', 'lineOrder', [0]);
  attribute('pixelAspectRatio', 'float', float(1));
  attribute('screenWindowCenter', 'v2f', [...float(0), ...float(0)]);
  attribute('screenWindowWidth', 'float', float(1));
  header.push(0);
  const lineBytes = sorted.reduce((sum, { type }) => sum + SIZE[type] * width, 0);
  const file = new Uint8Array(header.length + height * (16 + lineBytes));
  const view = new DataView(file.buffer);
  file.set(header);
  let at = header.length + 8 * height;
  for (let row = 0; row < height; row++) {
    view.setBigUint64(header.length + 8 * row, BigInt(at), true);
    view.setInt32(at, y0 + row, true);
    view.setInt32(at + 4, lineBytes, true);
    at += 8;
    for (const { type, data } of sorted) {
      const part = data.subarray(row * width, (row + 1) * width);
      file.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
      at += SIZE[type] * width;
    }
  }
  return file;
}
