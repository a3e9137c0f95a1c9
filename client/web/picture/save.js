// Saves the picture: PNG as it is shown, EXR with every channel at hand.

import { writeExr, writeZipExr } from './exr.js';

const SLICE_MS = 12;

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

// What writeExr takes of the film's window; null: no whole picture of the present view has come yet. copied: as it is
// now, whatever comes later.
function partsOf(picture, copied = false) {
  const { film, window: area } = picture;
  if (!film || !picture.complete) return null;
  const [x0, y0, x1, y1] = area,
    width = x1 - x0;
  const whole = width === film.width && y1 - y0 === film.height;
  const channels = film.names(picture.revision).map((name) => {
    const plane = film.planes.get(name);
    if (whole) return { name, type: plane.type, data: copied ? plane.data.slice() : plane.data };
    const data = new plane.data.constructor(width * (y1 - y0));
    for (let y = y0; y < y1; y++)
      data.set(plane.data.subarray(y * film.width + x0, y * film.width + x1), (y - y0) * width);
    return { name, type: plane.type, data };
  });
  return [film.width, film.height, area, channels];
}

// The bytes of an EXR without compression; null: as above.
export function exrOf(picture) {
  const parts = partsOf(picture);
  return parts && writeExr(...parts);
}

// Lets the page go on every SLICE_MS. By a message, which a hidden page gets at once, too.
function slices() {
  let begun = performance.now();
  return async () => {
    if (performance.now() - begun < SLICE_MS) return;
    await new Promise((resume) => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = () => {
        port1.close();
        resume();
      };
      port2.postMessage(null);
    });
    begun = performance.now();
  };
}

// False: there is no whole picture of the present view yet.
export async function savePicture(picture, kind, name) {
  if (kind === 'png') {
    download(await pngOf(picture), `${name}.png`);
    return true;
  }
  const parts = partsOf(picture, true);
  if (!parts) return false;
  let file;
  try {
    file = await writeZipExr(...parts, slices());
  } catch {
    file = [writeExr(...parts)]; // the library that compresses was not to be had: the daemon is gone
  }
  download(new Blob(file, { type: 'image/x-exr' }), `${name}.exr`);
  return true;
}
