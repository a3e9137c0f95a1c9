// Standard error against time, both axes logarithmic: a line for each session, and the pinned picture's. The
// target is a line that can be dragged (or moved with the arrow keys): it becomes the budget's error.

import { make, section, short } from '../dom.js';
import { MOST_SESSIONS } from '../session_settings.js';

const NONE = [[1], ...Array.from({ length: MOST_SESSIONS + 1 }, () => [null])];
const GRAB = 8; // pixels from the line
const QUIET = '#8b919b',
  LINE = '#272b31',
  PINNED = '#6fa8ff',
  TARGET = '#86d29a';

export class ConvergencePlot {
  #pinned = [];
  #dragging = false;
  #timer = 0;
  #loading = null;

  constructor(app) {
    this.app = app;
    this.target = 0;
    this.holder = make('div', { id: 'plot', role: 'group', 'aria-label': 'Standard error against time' });
    this.note = make('p', { class: 'note', id: 'plot-note' });
    this.element = section('section-error', 'Convergence', true, this.holder, this.note);
    this.element.addEventListener('toggle', () => this.refresh());
  }

  // The library is fetched when there is something to plot, so that the first picture does not wait for it.
  #load() {
    if (this.#loading || !this.points.length) return;
    const loaded = () => {
      this.#create(globalThis.uPlot);
      this.refresh();
    };
    const failed = () => {
      this.#loading.remove();
      this.#loading = null; // the daemon is gone; asked again with the next point
    };
    this.#loading = make('script', { src: 'vendor/uplot.js', on: { load: loaded, error: failed } });
    document.head.append(this.#loading);
  }

  #create(uPlot) {
    const grid = { stroke: LINE, width: 1 };
    const axis = (size) => ({
      stroke: QUIET,
      grid,
      ticks: grid,
      font: '11px system-ui',
      size,
      gap: 3,
      splits: (u, index, low, high) => marks(low, high),
      filter: (u, splits) => splits,
      values: (u, splits) => splits.map((v) => short(v, 1)),
    });
    const log = { distr: 3, log: 10, auto: true };
    this.plot = new uPlot(
      {
        width: 290,
        height: 178,
        legend: { show: false },
        padding: [8, 8, 0, 0],
        cursor: { y: false, points: { size: 5 }, drag: { x: false, y: false } },
        scales: {
          x: { ...log, time: false, range: (u, low, high) => spread(low, high, 0.01) },
          y: {
            ...log,
            range: (u, low, high) =>
              spread(Math.min(low ?? 1, this.target || Infinity), Math.max(high ?? 1, this.target), 1e-9),
          },
        },
        axes: [axis(24), axis(46)],
        series: [
          {},
          { stroke: PINNED, width: 1, points: { show: false }, spanGaps: true },
          ...Array.from({ length: MOST_SESSIONS }, (_, i) => ({
            stroke: () => this.app.viewports[i]?.colour,
            width: 1.5,
            points: { show: false },
            spanGaps: true,
          })),
        ],
        hooks: { draw: [(u) => this.#drawTarget(u)] },
      },
      NONE,
      this.holder,
    );
    const { over } = this.plot;
    over.tabIndex = 0;
    over.id = 'plot-target';
    over.setAttribute('role', 'slider');
    over.setAttribute('aria-label', 'Target error: arrow keys move it, delete removes it');
    over.setAttribute('aria-orientation', 'vertical');
    over.addEventListener('pointerdown', (event) => {
      this.#dragging = true;
      over.setPointerCapture(event.pointerId);
      this.#dragTo(event);
    });
    over.addEventListener('pointermove', (event) => {
      const near = this.target && Math.abs(this.plot.valToPos(this.target, 'y') - this.#y(event)) < GRAB;
      over.style.cursor = near || this.#dragging ? 'ns-resize' : 'crosshair';
      if (this.#dragging) this.#dragTo(event);
    });
    over.addEventListener('pointerup', (event) => {
      if (!this.#dragging) return;
      this.#dragging = false;
      this.#dragTo(event);
      this.app.setBudget({ error: this.target });
    });
    over.addEventListener('pointercancel', () => {
      this.#dragging = false;
      this.refresh();
    });
    over.addEventListener('keydown', (event) => {
      const factor = { ArrowUp: 1.1, ArrowDown: 1 / 1.1, PageUp: 2, PageDown: 0.5 }[event.key];
      if (event.key === 'Delete') this.app.setBudget({ error: 0 });
      else if (factor) this.app.setBudget({ error: (this.target || this.points.at(-1)?.[1] || 0.01) * factor });
      else return;
      event.preventDefault();
    });
  }

  #y(event) {
    return event.clientY - this.plot.over.getBoundingClientRect().top;
  }

  #dragTo(event) {
    const value = this.plot.posToVal(Math.min(Math.max(this.#y(event), 1), this.plot.over.clientHeight - 1), 'y');
    if (value > 0) this.target = Number(value.toPrecision(3));
    this.plot.redraw(false);
    this.#say();
  }

  #drawTarget(u) {
    if (!this.target) return;
    const y = u.valToPos(this.target, 'y', true),
      { left, width } = u.bbox;
    u.ctx.save();
    u.ctx.strokeStyle = u.ctx.fillStyle = TARGET;
    u.ctx.setLineDash([4, 3]);
    u.ctx.beginPath();
    u.ctx.moveTo(left, y);
    u.ctx.lineTo(left + width, y);
    u.ctx.stroke();
    u.ctx.font = `${11 * devicePixelRatio}px system-ui`;
    u.ctx.textAlign = 'left';
    u.ctx.fillText(`target ${short(this.target, 3)}`, left + 4, y - 4);
    u.ctx.restore();
  }

  #say() {
    const last = this.points.at(-1);
    const now = last ? `Standard error ${short(last[1], 3)} after ${short(last[0], 3)} s. ` : '';
    const none = 'Click, drag or press arrow keys in the plot to set a target.';
    this.note.textContent = now + (this.target ? `Ends at ${short(this.target, 3)}.` : none);
    const highest = Math.max(this.target, ...this.points.map(([, error]) => error), 1e-6);
    const target = this.target ? short(this.target, 3) : 'none';
    const told = { valuemin: 0, valuemax: highest, valuenow: this.target, valuetext: target };
    for (const [name, value] of Object.entries(told)) {
      this.plot?.over.setAttribute(`aria-${name}`, String(value));
    }
  }

  // Takes what a session tells of its error now: a point when it has measured it anew.
  add({ progress, error, points }) {
    const [seconds, before] = points.at(-1) ?? [0, 0];
    if (!error || error.rmse === before || !(progress?.seconds > seconds)) return;
    points.push([progress.seconds, error.rmse]);
    if (points.length > 1000) points.splice(0, 1000, ...points.filter((point, i) => i % 2 || i > 900));
    this.#timer ||= setTimeout(() => this.refresh(), 250);
  }

  pin() {
    this.#pinned = [...this.points];
    this.refresh();
  }

  unpin() {
    this.#pinned = [];
    this.refresh();
  }

  // The points of the first session.
  get points() {
    return this.app.main.points;
  }

  refresh() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    if (!this.#dragging) this.target = this.app.budget.error || 0;
    if (!this.element.open || !this.holder.clientWidth) return;
    if (!this.plot) {
      this.#load();
      return;
    }
    if (this.plot.width !== this.holder.clientWidth) this.plot.setSize({ width: this.holder.clientWidth, height: 178 });
    const { viewports } = this.app;
    const all = [this.#pinned, ...Array.from({ length: MOST_SESSIONS }, (_, i) => viewports[i]?.points ?? [])];
    const times = [...new Set(all.flat().map(([time]) => time))].sort((a, b) => a - b);
    const columns = all.map((points) => {
      const at = new Map(points);
      return times.map((time) => at.get(time) ?? null);
    });
    this.plot.setData(times.length ? [times, ...columns] : NONE);
    this.#say();
  }
}

// Where a logarithmic axis is labelled: powers of ten, and 2 and 5 times them where these are few.
function marks(low, high) {
  if (!(low > 0) || !(high > low)) return [];
  const decades = Math.log10(high / low),
    factors = decades > 2.5 ? [1] : decades > 1.2 ? [1, 3] : [1, 2, 5];
  const step = Math.max(1, Math.ceil(decades / 5));
  const found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += step) {
    for (const factor of factors) {
      const value = Number((factor * 10 ** power).toPrecision(1));
      if (value >= low && value <= high) found.push(value);
    }
  }
  return found;
}

// Limits of a logarithmic axis around what is shown.
function spread(low, high, least) {
  const from = Math.max(Number.isFinite(low) && low > 0 ? low : 0.1, least);
  const to = Math.max(Number.isFinite(high) ? high : 1, from * 4);
  return [from / 1.3, to * 1.3];
}
