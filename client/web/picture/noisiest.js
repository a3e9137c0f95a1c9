// Where a picture is noisiest.

import { HALF } from './exr.js';
import { halfToFloat } from './half.js';

const BLOCK = 16; // pixels a side

// [x, y] of the pixel of the highest standard error in the block of 16 x 16 pixels of the highest mean variance, both
// as means over the channels; null: no variance is known. film: a Layer; [x0, y0, x1, y1): where to look, in whole
// pixels; isKnown(x, y): the film's pixel belongs to the picture.
export function noisiestPixel(film, [x0, y0, x1, y1], isKnown) {
  const planes = ['variance.R', 'variance.G', 'variance.B'].map((name) => film.planes.get(name));
  if (!planes.every(Boolean)) return null;
  const read = ({ type, data }, i) => (type === HALF ? halfToFloat[data[i]] : data[i]);
  const variance = (x, y) => planes.reduce((sum, plane) => sum + read(plane, y * film.width + x), 0) / planes.length;
  let worst = null;
  for (let top = y0; top < y1; top += BLOCK) {
    for (let left = x0; left < x1; left += BLOCK) {
      const block = { sum: 0, count: 0, most: -1, at: null };
      for (let y = top; y < Math.min(top + BLOCK, y1); y++) {
        for (let x = left; x < Math.min(left + BLOCK, x1); x++) {
          const value = variance(x, y);
          if (!Number.isFinite(value) || !isKnown(x, y)) continue;
          block.sum += value;
          block.count++;
          if (value > block.most) Object.assign(block, { most: value, at: [x, y] });
        }
      }
      block.mean = block.sum / block.count;
      if (block.count && (!worst || block.mean > worst.mean)) worst = block;
    }
  }
  return worst?.at ?? null;
}
