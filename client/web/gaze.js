// Where the person at the page looks: the point under the pointer, or one that is pinned. With the setting foveation
// all sessions are told of it.

import { announce } from './messages.js';

const LEAST_MOVE = 1; // pixels of the film

export class Gaze {
  pinned = false;
  #at = null; // { x, y }, pixels of the film
  #frame = 0;

  constructor(app) {
    this.app = app;
  }

  get on() {
    const { wanted, connection } = this.app;
    return wanted.foveation > 0 && wanted.foveation === connection.codec?.enum('Foveation').FOVEATION_DENSITY;
  }

  // Of the views that are sent; null: none.
  get at() {
    return this.on ? this.#at : null;
  }

  // Follows the pointer over a picture.
  listen(viewport) {
    const { overlay } = viewport;
    overlay.addEventListener('pointermove', (event) => {
      const box = overlay.getBoundingClientRect();
      this.lookAt(viewport, event.clientX - box.left, event.clientY - box.top);
    });
  }

  // The pointer is there, CSS pixels of the stage. Beside the picture the last point stays.
  lookAt(viewport, x, y) {
    if (!this.on || this.pinned) return;
    const [fx, fy] = viewport.filmAt(x, y);
    const { width, height } = viewport.picture;
    if (!(fx >= 0 && fy >= 0 && fx < width && fy < height)) return;
    if (this.#at && Math.hypot(fx - this.#at.x, fy - this.#at.y) < LEAST_MOVE) return;
    this.#at = { x: fx, y: fy };
    this.#frame ||= requestAnimationFrame(() => {
      this.#frame = 0;
      for (const { session } of this.app.viewports) session.moveGaze(this.at);
    });
  }

  // Other settings or another size. Where nobody has pointed yet, the middle is looked at.
  refresh(width, height) {
    if (!this.on) this.pinned = false;
    const outside = this.#at && !(this.#at.x < width && this.#at.y < height);
    if (this.on && (!this.#at || outside)) this.#at = { x: width / 2, y: height / 2 };
    for (const { session } of this.app.viewports) session.gaze = this.at;
  }

  pin() {
    if (!this.on) {
      announce('Foveation is off: samples go everywhere.');
      return;
    }
    this.pinned = !this.pinned;
    announce(this.pinned ? 'The gaze stays here.' : 'The gaze follows the pointer.');
    for (const viewport of this.app.viewports) this.app.drawOverlay(viewport);
  }
}
