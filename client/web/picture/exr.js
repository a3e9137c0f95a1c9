// OpenEXR as the daemon sends it: scan lines, half, float or uint channels, no compression, RLE, ZIPS or ZIP.
// After the format's description, openexr.com/en/latest/OpenEXRFileLayout.html. And writers: no compression, and ZIP.

const MAGIC = 20000630;
const NONE = 0,
  RLE = 1,
  ZIPS = 2,
  ZIP = 3;
const ZIP_ROWS = 16; // of a chunk
const ZIP_LEVEL = 4; // OpenEXR's own
const UINT = 0;
export const HALF = 1;
export const FLOAT = 2;
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
  const lines = header.compression === ZIP ? ZIP_ROWS : 1;
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

// What comes before the table of chunks. channels: as writeExr has them, sorted by their names.
function headerOf(frameWidth, frameHeight, [x0, y0, x1, y1], channels, compression) {
  const header = [];
  const int = (value) => [value & 255, (value >> 8) & 255, (value >> 16) & 255, (value >> 24) & 255];
  const word = (value) => [...new TextEncoder().encode(value), 0];
  const float = (value) => [...new Uint8Array(new Float32Array([value]).buffer)];
  const attribute = (name, type, value) => header.push(...word(name), ...word(type), ...int(value.length), ...value);
  header.push(...int(MAGIC), ...int(2));
  attribute('channels', 'chlist', [
    ...channels.flatMap(({ name, type }) => [...word(name), ...int(type), 0, 0, 0, 0, ...int(1), ...int(1)]),
    0,
  ]);
  attribute('compression', 'compression', [compression]);
  attribute('dataWindow', 'box2i', [x0, y0, x1 - 1, y1 - 1].flatMap(int));
  attribute('displayWindow', 'box2i', [0, 0, frameWidth - 1, frameHeight - 1].flatMap(int));
  attribute('lineOrder', 'lineOrder', [0]);
  attribute('pixelAspectRatio', 'float', float(1));
  attribute('screenWindowCenter', 'v2f', [...float(0), ...float(0)]);
  attribute('screenWindowWidth', 'float', float(1));
  header.push(0);
  return new Uint8Array(header);
}

const byName = (channels) => [...channels].sort((a, b) => (a.name < b.name ? -1 : 1));
const bytesOfLine = (channels, width) => channels.reduce((sum, { type }) => sum + SIZE[type] * width, 0);

// Writes a row of all channels to `file` from `at` on.
function putLine(file, at, channels, row, width) {
  for (const { type, data } of channels) {
    const part = data.subarray(row * width, (row + 1) * width);
    file.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += SIZE[type] * width;
  }
}

// A file of one window, without compression. channels: [{ name, type, data }], data Uint16Array of halfs or
// Float32Array, as many pixels a row as the window has; in whatever order.
export function writeExr(frameWidth, frameHeight, window, channels) {
  const [x0, y0, x1, y1] = window,
    width = x1 - x0,
    height = y1 - y0;
  const sorted = byName(channels);
  const header = headerOf(frameWidth, frameHeight, window, sorted, NONE);
  const lineBytes = bytesOfLine(sorted, width);
  const file = new Uint8Array(header.length + height * (16 + lineBytes));
  const view = new DataView(file.buffer);
  file.set(header);
  let at = header.length + 8 * height;
  for (let row = 0; row < height; row++) {
    view.setBigUint64(header.length + 8 * row, BigInt(at), true);
    view.setInt32(at, y0 + row, true);
    view.setInt32(at + 4, lineBytes, true);
    putLine(file, at + 8, sorted, row, width);
    at += 8 + lineBytes;
  }
  return file;
}

// The same with ZIP compression, as parts in their order. pause(): awaited after each chunk of 16 rows, so that the
// page goes on meanwhile; channels must stay as they are.
export async function writeZipExr(frameWidth, frameHeight, window, channels, pause) {
  const { zlibSync } = await import('../vendor/fflate.js');
  const [x0, y0, x1, y1] = window,
    width = x1 - x0,
    height = y1 - y0;
  const sorted = byName(channels);
  const header = headerOf(frameWidth, frameHeight, window, sorted, ZIP);
  const lineBytes = bytesOfLine(sorted, width);
  const table = new BigUint64Array(Math.ceil(height / ZIP_ROWS));
  const parts = [header, table];
  let at = header.length + table.byteLength;
  for (let top = 0; top < height; top += ZIP_ROWS) {
    const rows = Math.min(ZIP_ROWS, height - top);
    const raw = new Uint8Array(rows * lineBytes);
    for (let row = 0; row < rows; row++) putLine(raw, row * lineBytes, sorted, top + row, width);
    const packed = zlibSync(pack(raw), { level: ZIP_LEVEL });
    const chunk = packed.length < raw.length ? packed : raw;
    table[top / ZIP_ROWS] = BigInt(at);
    parts.push(new Int32Array([y0 + top, chunk.length]), chunk);
    at += 8 + chunk.length;
    await pause();
  }
  return parts;
}

// Even bytes before odd ones, each as its difference from the one before: the inverse of what unpack() ends with.
function pack(bytes) {
  const packed = new Uint8Array(bytes.length),
    half = (bytes.length + 1) >> 1;
  for (let i = 0; i < bytes.length; i++) packed[(i & 1 ? half : 0) + (i >> 1)] = bytes[i];
  for (let i = bytes.length - 1; i > 0; i--) packed[i] = packed[i] - packed[i - 1] + 128;
  return packed;
}
