// What a drag on the picture, or keys, do besides moving the camera: drawing a box, moving the enlarged picture, moving
// the split.

import { Compare } from './picture/compare.js';

const GRAB = 14; // CSS pixels
const GRAB_TOUCH = 28;
const STEP = 1 / 40; // of the picture's longer side, by an arrow key
const HAND_STEP = 40; // CSS pixels
const LEAST = 4; // film pixels a side

// Draws a box: the region that is rendered ('region'), or the one that the picture is enlarged to ('zoom').
export class BoxTool {
  constructor(app, use) {
    this.app = app;
    this.use = use;
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

  // The first key shows a box in the middle; arrows move it, with shift its lower right corner; enter takes it.
  key(viewport, event, arrow) {
    const sides = [viewport.picture.width, viewport.picture.height];
    if (!sides[0] || (!arrow && event.key !== 'Enter')) return false;
    if (!viewport.box) {
      viewport.box = [...sides.map((side) => Math.round(side / 4)), ...sides.map((side) => Math.round((3 * side) / 4))];
    } else if (arrow) {
      const step = Math.max(1, Math.round(Math.max(...sides) * STEP));
      arrow.forEach((direction, i) => {
        const size = viewport.box[i + 2] - viewport.box[i];
        const low = event.shiftKey ? viewport.box[i] + LEAST : size;
        const end = Math.min(Math.max(viewport.box[i + 2] + direction * step, low), sides[i]);
        if (!event.shiftKey) viewport.box[i] = end - size;
        viewport.box[i + 2] = end;
      });
    } else {
      this.up(viewport);
    }
    viewport.invalidate();
    return true;
  }

  // Draws nothing more.
  leave() {
    for (const viewport of this.app.viewports) {
      viewport.box = null;
      viewport.invalidate();
    }
    this.app.useTool(null);
  }

  up(viewport) {
    const { box } = viewport;
    this.leave();
    if (box[2] - box[0] < LEAST || box[3] - box[1] < LEAST) return;
    if (this.use === 'zoom') viewport.showBox(box);
    else this.app.setSettings({ region: box });
  }
}

// Moves the enlarged picture by drags and arrow keys.
export class HandTool {
  constructor(app) {
    this.app = app;
    this.use = 'hand';
  }

  down(viewport, x, y) {
    this.from = [x, y];
    return true;
  }

  move(viewport, x, y) {
    viewport.shift(x - this.from[0], y - this.from[1]);
    this.from = [x, y];
  }

  key(viewport, event, arrow) {
    if (arrow) viewport.shift(-arrow[0] * HAND_STEP, -arrow[1] * HAND_STEP);
    return !!arrow;
  }

  up() {}

  leave() {
    this.app.useTool(null);
  }
}

export class SplitTool {
  constructor(app) {
    this.app = app;
  }

  down(viewport, x, y, event) {
    if (this.app.comparing(viewport) !== Compare.SPLIT) return false;
    const { picture, ratio } = viewport;
    const at = (picture.origin[0] + this.app.look.split * picture.width * picture.zoom) / ratio;
    return Math.abs(at - x) < (event.pointerType === 'touch' ? GRAB_TOUCH : GRAB);
  }

  move(viewport, x, y) {
    this.app.moveSplit(viewport.filmAt(x, y)[0] / viewport.picture.width - this.app.look.split);
  }

  key() {
    return false;
  }

  up() {}

  leave() {}
}
