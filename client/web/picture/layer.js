// A picture in memory: one plane of numbers for each channel, filled tile by tile, and the textures that show some of
// them. Planes stay when the WebGL context goes; textures hold only what the shader asks for.

import { FLOAT, HALF, readHeader, readPixels } from './exr.js';
import { halfToFloat } from './half.js';
import { loadArrays } from './gl.js';

const ALWAYS_FLOAT = new Set(['samples', 'Z']); // the daemon switches their type with their values

export class Layer {
  #halfs = [];

  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.planes = new Map();
    this.textures = null;
    this.dirty = [];
  }

  #plane(name, type) {
    let plane = this.planes.get(name);
    if (plane && plane.type === FLOAT && type === HALF) return plane;
    if (!plane || plane.type !== type) {
      const size = this.width * this.height;
      const data = type === HALF ? new Uint16Array(size) : new Float32Array(size);
      if (plane) this.textures?.forget();
      if (plane) for (let i = 0; i < size; i++) data[i] = halfToFloat[plane.data[i]];
      plane = { type, data, bytes: new Uint8Array(data.buffer), width: this.width, stamp: -1 };
      this.planes.set(name, plane);
    }
    return plane;
  }

  // Halfs on their way to a float plane; kept, since every tile needs them.
  #scratch(number) {
    if (!this.#halfs[number]) {
      const data = new Uint16Array(this.width * this.height);
      this.#halfs[number] = { data, bytes: new Uint8Array(data.buffer), width: this.width };
    }
    return this.#halfs[number];
  }

  // Takes an EXR file's pixels. stamp: of the picture that it belongs to, kept with each channel that it has.
  addExr(bytes, stamp) {
    const header = readHeader(bytes);
    const [x0, y0, x1, y1] = header.window;
    if (x0 < 0 || y0 < 0 || x1 > this.width || y1 > this.height) throw new Error('a tile outside its picture');
    const converted = [];
    readPixels(bytes, header, (name, type) => {
      const plane = this.#plane(name, ALWAYS_FLOAT.has(name) ? FLOAT : type);
      plane.stamp = stamp;
      if (plane.type === type) return plane;
      const halfs = this.#scratch(converted.length);
      converted.push([plane, halfs.data]);
      return halfs;
    });
    for (const [plane, halfs] of converted) {
      for (let y = y0; y < y1; y++) {
        for (let i = y * this.width + x0, end = i + x1 - x0; i < end; i++) plane.data[i] = halfToFloat[halfs[i]];
      }
    }
    if (this.dirty.length > 1000) this.dirty = [[0, 0, this.width, this.height]];
    this.dirty.push(header.window);
    return header.window;
  }

  // The number of a channel in a pixel; undefined: there is none.
  at(name, x, y) {
    const plane = this.planes.get(name);
    if (!plane || x < 0 || y < 0 || x >= this.width || y >= this.height) return undefined;
    const value = plane.data[y * this.width + x];
    return plane.type === HALF ? halfToFloat[value] : value;
  }

  // Channels that came with the picture of this stamp.
  names(stamp) {
    return [...this.planes].filter(([, plane]) => stamp === undefined || plane.stamp === stamp).map(([name]) => name);
  }

  clone() {
    const copy = new Layer(this.width, this.height);
    for (const [name, plane] of this.planes) {
      const data = plane.data.slice();
      copy.planes.set(name, { ...plane, data, bytes: new Uint8Array(data.buffer) });
    }
    return copy;
  }

  // Textures that hold these planes as they are now; gl.js tells where (loadArrays).
  show(gl, names) {
    this.textures ??= loadArrays(gl, this);
    this.textures.show(names);
    return this.textures;
  }

  release() {
    this.textures?.dispose();
    this.textures = null;
  }
}
