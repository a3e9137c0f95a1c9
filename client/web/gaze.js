// Where the person at the page looks: the point under the pointer, the pixel that keys or a tap inspect, or a point that
// is pinned. With the setting foveation all sessions are told of it.

import { announce } from './messages.js';

const LEAST_MOVE = 0.9; // pixels of the film

export class Gaze {
  pinned = false;
  #part = null; // [u, v] in parts of the film's sides, so that it stays where it is when the size changes
  #film = { width: 0, height: 0 };
  #frame = 0;

  constructor(app) {
    this.app = app;
  }

  get on() {
    const { wanted, connection } = this.app;
    const { FOVEATION_DENSITY, FOVEATION_PAPER } = connection.codec?.enum('Foveation') ?? {};
    return wanted.foveation > 0 && [FOVEATION_DENSITY, FOVEATION_PAPER].includes(wanted.foveation);
  }

  // { x, y } in pixels of the film that is wanted, as the sessions are told; null: none.
  get at() {
    return this.of(this.#film);
  }

  // The same in pixels of a picture that has perhaps another size.
  of({ width, height }) {
    if (!this.on || !this.#part) return null;
    const [u, v] = this.#part;
    return { x: u * width, y: v * height };
  }

  // Follows the pointer over a picture; of fingers the first.
  listen(viewport) {
    const { overlay } = viewport;
    overlay.addEventListener('pointermove', (event) => {
      if (!event.isPrimary) return;
      const box = overlay.getBoundingClientRect();
      this.lookAt(viewport, event.clientX - box.left, event.clientY - box.top);
    });
  }

  // Looks at a point of the stage, CSS pixels. Beside the picture the last point stays.
  lookAt(viewport, x, y) {
    if (!this.on || this.pinned) return;
    const [fx, fy] = viewport.filmAt(x, y);
    const { width, height } = viewport.picture;
    if (!(fx >= 0 && fy >= 0 && fx < width && fy < height)) return;
    const last = this.of({ width, height });
    if (last && Math.hypot(fx - last.x, fy - last.y) < LEAST_MOVE) return;
    this.#part = [fx / width, fy / height];
    this.#frame ||= requestAnimationFrame(() => {
      this.#frame = 0;
      this.#tell();
    });
  }

  // Other settings, another size or other sessions. Where nobody has pointed yet, the middle is looked at.
  refresh(width, height) {
    this.#film = { width, height };
    if (this.on) this.#part ??= [0.5, 0.5];
    else this.#pin(false);
    this.#tell();
  }

  #tell() {
    const { viewports, counters } = this.app,
      { at } = this;
    for (const { session } of viewports) if (session.moveGaze(at)) counters.gazes++;
  }

  #pin(on) {
    if (this.pinned === on) return;
    this.pinned = on;
    this.app.gazePinned();
  }

  // Pins the point, or lets it go.
  pin() {
    if (!this.on) {
      announce('Foveation is off: samples go everywhere.');
      return;
    }
    this.#pin(!this.pinned);
    announce(this.pinned ? 'The gaze stays here.' : 'The gaze follows the pointer.');
  }
}
