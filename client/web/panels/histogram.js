// Histogram of what is shown, of some of the pixels: stops of radiance, or the values of a scalar channel.

import { channelById, isColour, Kind, valueOf } from '../picture/channels.js';
import { make } from '../dom.js';
import { HALF } from '../picture/exr.js';
import { halfToFloat } from '../picture/half.js';
import { Compare } from '../picture/compare.js';

const PIXELS = 40000; // looked at, at most
const BINS = 128;
const COLOURS = ['#ff6f61', '#7ed38b', '#6fa8ff'];

export class Histogram {
  constructor(app) {
    this.app = app;
    this.canvas = make('canvas', { id: 'histogram', role: 'img', 'aria-label': 'Histogram', width: 560, height: 128 });
    this.counts = [];
    this.values = new Float32Array(PIXELS + 1024);
  }

  // Draws it, and answers the 1st and the 99th percentile of what false colours show; null: there is no picture.
  measure() {
    const { picture } = this.app.active,
      { film } = picture;
    const compares = this.app.comparing();
    const chosen = channelById(this.app.active.picture.look.channel);
    const inErrors = compares === Compare.ERRORS && isColour(chosen);
    const channel = inErrors ? channelById('radiance') : chosen;
    if (!film || !channel.planes.every((name) => film.planes.has(name))) return null;
    const reference = compares >= Compare.ABSOLUTE && picture.comparable ? picture.reference : null;
    const stride = Math.max(1, Math.ceil(Math.sqrt((film.width * film.height) / PIXELS)));
    const colour = isColour(channel);
    const planes = channel.planes.map((name) => film.planes.get(name));
    this.app.look.floor = this.#floor(film, stride);
    const { floor } = this.app.look;
    const series = colour ? [[], [], []] : [[]];
    let count = 0;
    const read = (plane, i) => (plane.type === HALF ? halfToFloat[plane.data[i]] : plane.data[i]);
    const others = reference && channel.planes.map((name) => reference.planes.get(name));
    for (let y = stride >> 1; y < film.height; y += stride) {
      for (let x = stride >> 1; x < film.width; x += stride) {
        const i = y * film.width + x;
        let at = 0;
        const value = valueOf(channel, () => read(planes[at++], i), floor);
        let shown;
        if (colour) {
          value.forEach((v, c) => series[c].push(v));
          shown = 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
        } else {
          series[0].push(value);
          shown = value;
        }
        if (others?.every(Boolean)) {
          at = 0;
          const other = valueOf(channel, () => read(others[at++], i), floor);
          const difference = colour
            ? Math.sqrt(value.reduce((sum, v, c) => sum + (v - other[c]) ** 2, 0) / 3)
            : Math.abs(value - other);
          const base = colour ? (other[0] + other[1] + other[2]) / 3 : Math.abs(other);
          shown = compares === Compare.RELATIVE ? difference / Math.max(base, floor) : difference;
          if (inErrors) shown = picture.standardErrors(x, y) ?? NaN;
        }
        if (Number.isFinite(shown) && count < this.values.length) this.values[count++] = shown;
      }
    }
    this.#draw(series, channel);
    if (!count) return null;
    const sorted = this.values.subarray(0, count).sort();
    const first = this.app.look.logarithmic
      ? Math.max(
          0,
          sorted.findIndex((v) => v > 0),
        )
      : 0;
    return [sorted[first + Math.floor(0.01 * (count - 1 - first))], sorted[Math.ceil(0.99 * (count - 1))]];
  }

  // 1 % of the film's mean.
  #floor(film, stride) {
    let sum = 0,
      count = 0;
    for (let y = stride >> 1; y < film.height; y += stride) {
      for (let x = stride >> 1; x < film.width; x += stride) {
        const value = film.at('G', x, y);
        if (Number.isFinite(value)) [sum, count] = [sum + value, count + 1];
      }
    }
    return Math.max((0.01 * sum) / Math.max(count, 1), 1e-9);
  }

  #draw(series, channel) {
    const g = this.canvas.getContext('2d'),
      { width, height } = this.canvas;
    const logarithmic = channel.kind === Kind.RGB || channel.log;
    const place = logarithmic ? (v) => (Math.log2(v) + 12) / 18 : null; // 2^-12 to 2^6
    g.clearRect(0, 0, width, height);
    g.globalCompositeOperation = 'lighter';
    series.forEach((values, c) => {
      const finite = values.filter(Number.isFinite);
      let low = Infinity,
        high = -Infinity;
      for (const v of finite) {
        low = Math.min(low, v);
        high = Math.max(high, v);
      }
      const bins = new Float32Array(BINS);
      for (const v of finite) {
        const t = place ? place(Math.max(v, 1e-9)) : (v - low) / (high - low || 1);
        bins[Math.min(BINS - 1, Math.max(0, Math.floor(t * BINS)))]++;
      }
      if (place) bins[0] = 0; // black
      const peak = Math.max(...bins) || 1;
      g.fillStyle = series.length > 1 ? COLOURS[c] : '#c9ced6';
      g.globalAlpha = series.length > 1 ? 0.55 : 0.8;
      g.beginPath();
      g.moveTo(0, height);
      bins.forEach((n, i) => {
        const y = height - Math.sqrt(n / peak) * (height - 4);
        g.lineTo((i / BINS) * width, y);
        g.lineTo(((i + 1) / BINS) * width, y);
      });
      g.lineTo(width, height);
      g.fill();
    });
    g.globalAlpha = 1;
    g.globalCompositeOperation = 'source-over';
    if (channel.kind === Kind.RGB) {
      const white = place(2 ** -this.app.look.exposure) * width; // what is shown as white
      g.fillStyle = '#f0b860';
      g.fillRect(white, 0, 2, height);
    }
  }
}
