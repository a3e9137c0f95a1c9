// The canvas of a view, with all of the picture: a pixel of the canvas for each of the film, which the browser scales.
// Has what camera_input.js asks of a viewport.

import { make } from '../web/dom.js';
import { Picture } from '../web/picture/picture.js';

const KEYS = 'Picture. Drag or arrow keys orbit, shift and drag pans, the wheel moves to the cursor, W A S D Q E fly.';

export class Stage {
  #frame = 0;
  #waiting = []; // resolved when it was drawn
  #film = -1; // number of the frame in the film's planes
  #closed = false;

  constructor(app, parent) {
    this.canvas = make('canvas', { class: 'heliograph-picture', width: 1, height: 1 });
    this.overlay = make('div', { class: 'heliograph-input', tabIndex: 0, role: 'img', 'aria-label': KEYS });
    this.stage = make('div', { class: 'heliograph-stage' }, this.canvas, this.overlay);
    this.picture = new Picture(this.canvas, app.look, (lost) => {
      if (this.#closed) return;
      app.say(lost ? 'The graphics context was lost; the picture comes back when the browser gives it back.' : '');
      this.invalidate();
    });
    parent.append(this.stage);
  }

  // A message `picture`, and the bytes of its tiles.
  take(message, tiles) {
    const { picture } = this,
      { frame, view, size, region, seed } = message;
    const [width, height] = size,
      [x0, y0, x1, y1] = region;
    const tag = { revision: frame, view_id: view };
    const begin = { tag, settings: { width, height, seed, region: { x0, y0, x1, y1 } } };
    if (message.preview) {
      picture.beginPreview(begin);
      for (const exr of tiles) picture.addPreviewTile({ exr, jpeg: [] });
      picture.showPreview(tag, 1);
    } else {
      if (frame !== this.#film) picture.beginFilm(begin, '');
      this.#film = frame;
      for (const exr of tiles) picture.addTile({ tag, exr });
    }
    if (this.canvas.width !== width || this.canvas.height !== height) {
      Object.assign(this.canvas, { width, height });
      this.stage.style.aspectRatio = `${width} / ${height}`;
      this.stage.style.maxWidth = `${width}px`;
    }
    this.invalidate();
  }

  invalidate() {
    this.#frame ||= requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#frame = 0;
    if (this.#closed) return;
    const { picture, ratio } = this;
    picture.zoom = picture.width ? (this.stage.clientWidth * ratio) / picture.width : 1;
    picture.draw(true);
    for (const resolve of this.#waiting.splice(0)) resolve();
  }

  // Resolves when what was taken is on the screen.
  drawn() {
    return new Promise((resolve) => {
      this.#waiting.push(resolve);
      this.invalidate();
    });
  }

  get ratio() {
    return devicePixelRatio;
  }

  get aspect() {
    return this.picture.width / this.picture.height || 1;
  }

  filmAt(x, y) {
    const scale = this.picture.width / this.stage.clientWidth;
    return [x * scale, y * scale];
  }

  stageAt(x, y) {
    const scale = this.stage.clientWidth / this.picture.width;
    return [x * scale, y * scale];
  }

  uvAt(x, y) {
    const [fx, fy] = this.filmAt(x, y);
    return [(2 * fx) / this.picture.width - 1, 1 - (2 * fy) / this.picture.height];
  }

  // The picture is always shown as a whole.
  zoomBy() {}
  shift() {}

  close() {
    this.#closed = true;
    cancelAnimationFrame(this.#frame);
    const { picture } = this;
    picture.loseContext(0); // browsers keep 16 or so alive
    // Listeners of the window that camera_input.js adds hold this stage as long as the window lives: not its pixels.
    Object.assign(picture, { film: null, preview: null, under: null, reference: null });
  }
}
