// Saves the picture: PNG as it is shown, EXR with every channel at hand.

import { writeExr } from './exr.js';

function download(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export async function pngOf(picture) {
  const image = picture.snapshot();
  const canvas = new OffscreenCanvas(image.width, image.height);
  canvas.getContext('2d').putImageData(image, 0, 0);
  return canvas.convertToBlob({ type: 'image/png' });
}

// The film's window; null: no whole picture of the present view has come yet.
export function exrOf(picture) {
  const { film, window: area } = picture;
  if (!film || !picture.complete) return null;
  const [x0, y0, x1, y1] = area,
    width = x1 - x0;
  const channels = film.names(picture.revision).map((name) => {
    const plane = film.planes.get(name);
    if (width === film.width && y1 - y0 === film.height) return { name, type: plane.type, data: plane.data };
    const data = new plane.data.constructor(width * (y1 - y0));
    for (let y = y0; y < y1; y++)
      data.set(plane.data.subarray(y * film.width + x0, y * film.width + x1), (y - y0) * width);
    return { name, type: plane.type, data };
  });
  return writeExr(film.width, film.height, area, channels);
}

export async function savePicture(picture, kind, name) {
  if (kind === 'png') {
    download(await pngOf(picture), `${name}.png`);
    return true;
  }
  const file = exrOf(picture);
  if (file) download(new Blob([file], { type: 'image/x-exr' }), `${name}.exr`);
  return !!file;
}
