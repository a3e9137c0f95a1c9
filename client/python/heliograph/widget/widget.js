// A session in a notebook, as anywidget wants it: the picture, the camera under the mouse, exposure, channel, status.
// Pictures and messages go through the kernel (link.js); drawing, channels and camera are the modules of the daemon's
// page.

import { Camera } from '../web/camera/camera.js';
import { listenToCamera } from '../web/camera/camera_input.js';
import { channelById, channels, isColour } from '../web/picture/channels.js';
import { Compare } from '../web/picture/compare.js';
import { loadInflate } from '../web/picture/exr.js';
import { make, short } from '../web/dom.js';
import { Histogram } from '../web/panels/histogram.js';
import { newLook } from '../web/panels/picture_panel.js';
import { Controls } from './controls.js';
import { Link } from './link.js';
import { Stage } from './stage.js';
import { statusText } from './status.js';

const MEASURE_EVERY_MS = 400;

class View {
  #measured = 0;
  #under = [NaN, NaN]; // film pixel

  constructor(model, element) {
    this.model = model;
    this.look = newLook();
    this.look.exposure = model.get('exposure');
    this.camera = new Camera();
    // listenToCamera asks this of its app besides camera, moved, hover, pickPivot and pickFocus.
    this.tool = null;
    this.inspector = { viewport: null, at: null };
    this.histogram = new Histogram(this);

    this.status = make('span', { class: 'heliograph-status', role: 'status', text: 'Waiting for the first picture' });
    this.readout = make('span', { class: 'heliograph-readout' });
    this.problem = make('div', { class: 'heliograph-problem', role: 'alert', hidden: true });
    this.controls = new Controls(this.look, {
      channel: (id) => this.#choose('channel', id),
      exposure: (stops) => {
        this.look.exposure = stops;
        this.redraw();
      },
      keepExposure: (stops) => this.#choose('exposure', stops),
    });
    // Shortcuts of the notebook, such as D D for "delete the cell", must not take the camera's keys.
    this.root = make('div', { class: 'heliograph', 'data-lm-suppress-shortcuts': 'true' });
    this.root.addEventListener('keydown', (event) => event.stopPropagation());
    element.append(this.root);
    this.stage = new Stage(this, this.root);
    this.root.append(
      this.controls.element,
      make('div', { class: 'heliograph-line' }, this.status, this.readout),
      this.problem,
    );
    listenToCamera(this, this.stage);

    this.listeners = {
      'change:exposure': () => this.#adopt(),
      'change:channel': () => this.#adopt(),
    };
    for (const [event, listener] of Object.entries(this.listeners)) model.on(event, listener);
    this.link = new Link(model, {
      picture: (message, tiles) => this.#picture(message, tiles),
      problem: (text) => this.say(text),
      ended: (text) => {
        this.root.classList.add('heliograph-ended');
        this.say(text);
      },
    });
  }

  get active() {
    return this.stage;
  }

  comparing() {
    return Compare.NONE;
  }

  say(text) {
    this.problem.textContent = text;
    this.problem.hidden = !text;
  }

  redraw() {
    this.stage.invalidate();
  }

  #choose(name, value) {
    this.model.set(name, value);
    this.model.save_changes();
    this.#adopt();
  }

  // Takes the values of the model, which Python may have set.
  #adopt() {
    this.look.exposure = this.model.get('exposure');
    this.#refresh();
    this.redraw();
  }

  #refresh() {
    const { film, preview } = this.stage.picture;
    const has = new Set([...(film?.planes.keys() ?? []), ...(preview?.planes.keys() ?? [])]);
    const there = channels.filter((channel) => channel.planes.every((name) => has.has(name)));
    const wanted = this.model.get('channel');
    const find = (id) => there.find((channel) => channel.id === id);
    const usual = film?.planes.has('display.R') ? 'display' : 'radiance';
    this.look.channel = (find(wanted) ?? channelById(usual)).id;
    this.controls.refresh(there, there.length && wanted && !find(wanted) ? wanted : '');
    this.#measure();
  }

  // Fits the range of false colours to the picture.
  #measure() {
    const { look } = this;
    if (isColour(channelById(look.channel))) return;
    this.#measured = performance.now();
    const values = this.histogram.measure();
    if (!values) return;
    const [low, high] = values;
    look.range = look.logarithmic ? [Math.max(low, high * 1e-3, 1e-12), Math.max(high, 1e-11)] : [low, high];
    if (look.range[0] >= look.range[1]) look.range[1] = look.range[0] * 1.01 + 1e-9;
    this.controls.showRange();
  }

  #picture(message, tiles) {
    const { status, camera, bounds, move } = message;
    const names = this.stage.picture.film?.planes.size;
    this.stage.take(message, tiles);
    this.status.textContent = statusText(message);
    if (status.ended_by === 'failed') this.say(`The picture failed: ${status.message}`);
    if (!this.link.moving(move)) {
      this.camera.start({ bounds_min: bounds[0], bounds_max: bounds[1], cameras: [camera] });
      this.camera.pivot = camera.pivot;
    }
    if (names !== this.stage.picture.film?.planes.size) this.#refresh();
    else if (performance.now() - this.#measured > MEASURE_EVERY_MS || status.ended_by) this.#measure();
    this.#read();
    this.stage.drawn().then(() => this.link.drawn(message.picture));
  }

  // ---- what listenToCamera calls

  moved() {
    if (this.stage.picture.width) this.link.sendCamera(this.camera);
  }

  // The point at a place of the stage, CSS pixels; null: it is not known.
  #pick(stage, x, y) {
    const at = stage.filmAt(x, y).map(Math.floor);
    const depth = stage.picture.pixel(...at)?.Z;
    if (depth === undefined) {
      this.say('Which point that is tells the channel depth: open the session with channels="depth".');
      return null;
    }
    return Number.isFinite(depth) ? this.camera.pointAt(...stage.uvAt(x, y), stage.aspect, depth) : null;
  }

  pickPivot(stage, x, y) {
    const point = this.#pick(stage, x, y);
    if (point) this.camera.pivot = point;
  }

  hover(stage, x, y) {
    this.#under = stage.filmAt(x, y).map(Math.floor);
    this.#read();
  }

  // Tells the numbers of the pixel under the pointer.
  #read() {
    const [px, py] = this.#under;
    const pixel = Number.isFinite(px) ? this.stage.picture.pixel(px, py) : null;
    const colour = ['R', 'G', 'B'].map((name) => pixel?.[name]);
    if (!pixel || colour.includes(undefined)) {
      this.readout.textContent = '';
      return;
    }
    const errors = ['R', 'G', 'B'].map((name) => Math.sqrt(pixel[`variance.${name}`]));
    const numbers = colour.map(
      (value, i) => short(value, 3) + (Number.isNaN(errors[i]) ? '' : ` ± ${short(errors[i], 2)}`),
    );
    this.readout.textContent = `(${px}, ${py}) ${numbers.join(', ')}`;
  }

  close() {
    this.link.close();
    for (const [event, listener] of Object.entries(this.listeners)) this.model.off(event, listener);
    this.stage.close();
    this.root.remove();
  }
}

async function render({ model, el }) {
  try {
    await loadInflate(); // tiles from other machines are compressed
    const view = new View(model, el);
    return () => view.close();
  } catch (error) {
    const why =
      error.message === 'WebGL2' ? 'this browser has no WebGL2, with which pictures are drawn' : error.message;
    el.replaceChildren(make('div', { class: 'heliograph-problem', role: 'alert', text: `No picture: ${why}.` }));
    return undefined;
  }
}

export default { render };
