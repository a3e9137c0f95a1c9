// The place of one picture on the page: its canvases, and where there are several sessions a bar over them with the
// session's name, what it tells of its error, and buttons.

import { button, make, short } from './dom.js';

// [seconds, error] points as a curve, both logarithmic: the error at a time, null outside.
function errorAt(points, seconds) {
  const after = points.findIndex(([time]) => time >= seconds);
  if (after < 0) return null;
  const [t1, e1] = points[after];
  if (t1 === seconds) return e1;
  if (!after) return null;
  const [t0, e0] = points[after - 1];
  return e0 * (e1 / e0) ** (Math.log(seconds / t0) / Math.log(t1 / t0));
}

// { ratio, seconds }: error of the one over that of the other when both had been rendering for so long, the latest such
// time. null: there is none.
export function ratioAtEqualTime(points, others) {
  if (!points.length || !others.length) return null;
  const seconds = Math.min(points.at(-1)[0], others.at(-1)[0]);
  const [error, other] = [errorAt(points, seconds), errorAt(others, seconds)];
  return error && other ? { ratio: error / other, seconds } : null;
}

export class Tile {
  constructor(app, viewport) {
    Object.assign(this, { app, viewport });
    this.overlay = make('canvas', {
      class: 'overlay',
      tabIndex: 0,
      role: 'application',
      'aria-describedby': 'view-help',
    });
    this.name = make('span');
    this.edit = button('', '', () => app.panels.sessions.show(viewport), { class: 'name' });
    this.edit.append((this.line = make('i')), this.name);
    this.main = button('', '↖', () => app.makeMain(viewport));
    this.close = button('', '×', () => app.closeSession(viewport));
    this.figures = make('p', { class: 'figures' });
    const head = make('div', { class: 'head' }, this.edit, this.main, this.close);
    this.bar = make('div', { class: 'bar', hidden: true }, head, this.figures);
    this.element = make('section', { class: 'stage' }, make('canvas', { class: 'picture' }), this.overlay, this.bar);
  }

  // number: among the sessions, from 0; colour: of its line in the plot.
  refresh(number, several, colour) {
    const { name } = this.viewport,
      id = number ? `-${number + 1}` : '';
    this.element.setAttribute('aria-label', several ? `Picture ${number + 1}: ${name}` : 'Picture');
    this.overlay.id = `view${id}`;
    this.overlay.setAttribute(
      'aria-label',
      number
        ? `${name}. Same camera as the first picture.`
        : 'Rendered picture. Drag or arrow keys: orbit. W A S D Q E: fly. Question mark: all keys.',
    );
    for (const [part, does] of Object.entries({ edit: 'Edit', main: 'Make first', close: 'Close' })) {
      this[part].id = `tile-${number + 1}-${part}`;
      this[part].title = `${does}: ${name}`;
      this[part].setAttribute('aria-label', this[part].title);
    }
    this.name.textContent = name;
    this.line.style.background = colour;
    this.main.hidden = !number;
    this.bar.hidden = !several;
    this.tell();
  }

  // Shows what the session is at, and its error beside that of the first.
  tell() {
    if (this.bar.hidden) return;
    const { app, viewport } = this,
      { progress, error, trouble } = viewport;
    const parts = [];
    if (trouble) parts.push([trouble]);
    else if (app.paused && !progress) parts.push(['paused']);
    else if (viewport.behind || !progress) parts.push([viewport.moving ? 'moving' : 'rendering']);
    else {
      const ratio = viewport !== app.main && ratioAtEqualTime(viewport.points, app.main.points);
      const shows = ['oidn', 'display'].includes(viewport.own.layer) ? 'display error' : 'error';
      parts.push([error ? `${shows} ${short(error.rmse, 3)}` : `${shows} not known`]);
      if (ratio) parts.push([`${short(ratio.ratio, 3)} × first at ${short(ratio.seconds, 2)} s`]);
      if (error?.relmse) parts.push([`relMSE ${short(error.relmse, 3)}`, 'more']);
      parts.push([`${progress.samples_per_pixel.toLocaleString('en')} samples`, 'more']);
      parts.push([`${short(progress.seconds, 3)} s`, 'more']);
    }
    this.figures.classList.toggle('bad', !!trouble);
    this.figures.replaceChildren(...parts.flatMap(([text, of]) => [make('span', { text, class: of }), ' ']));
  }
}
