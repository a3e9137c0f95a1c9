// What a drag on the picture does besides moving the camera: drawing the region, and moving the split.

import { Compare } from './picture/compare.js';

const GRAB = 14; // CSS pixels

export class RegionTool {
  constructor(app) {
    this.app = app;
  }

  #corner(viewport, x, y, up) {
    const { width, height } = viewport.picture;
    return viewport.filmAt(x, y).map((v, i) => Math.min(Math.max(up(v), 0), i ? height : width));
  }

  down(viewport, x, y) {
    this.from = [x, y];
    this.move(viewport, x, y);
    return true;
  }

  move(viewport, x, y) {
    const [fx, fy] = this.from;
    viewport.box = [
      ...this.#corner(viewport, Math.min(x, fx), Math.min(y, fy), Math.floor),
      ...this.#corner(viewport, Math.max(x, fx), Math.max(y, fy), Math.ceil),
    ];
    viewport.invalidate();
  }

  // Draws nothing more.
  leave() {
    this.app.tool = this.app.splitTool;
    for (const viewport of this.app.viewports) {
      delete viewport.overlay.dataset.tool;
      viewport.box = null;
      viewport.invalidate();
    }
  }

  up(viewport) {
    const [x0, y0, x1, y1] = viewport.box;
    this.leave();
    if (x1 - x0 > 3 && y1 - y0 > 3) this.app.setSettings({ region: [x0, y0, x1, y1] });
  }
}

export class SplitTool {
  constructor(app) {
    this.app = app;
  }

  down(viewport, x) {
    if (this.app.comparing(viewport) !== Compare.SPLIT) return false;
    const { picture, ratio } = viewport;
    const at = (picture.origin[0] + this.app.look.split * picture.width * picture.zoom) / ratio;
    return Math.abs(at - x) < GRAB;
  }

  move(viewport, x, y) {
    this.app.look.split = Math.min(Math.max(viewport.filmAt(x, y)[0] / viewport.picture.width, 0), 1);
    this.app.redraw();
  }

  up() {}

  leave() {}
}
