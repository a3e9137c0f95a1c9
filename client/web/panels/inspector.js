// The pixel under the pointer: value and standard error of each channel, samples, history, and what else is at hand.

import { button, find, make, short } from '../dom.js';
import { toSrgbByte } from '../picture/srgb.js';

export class Inspector {
  constructor(app) {
    this.app = app;
    this.element = find('inspector');
    this.viewport = null;
    this.at = null;
    this.shown = true;
    this.body = make('div');
    this.close = button('inspector-close', '×', () => app.hover(this.viewport, NaN, NaN), {
      'aria-label': 'Close the inspector',
    });
    this.more = button('inspector-more', '⋯', () => this.#showAll(!this.element.classList.contains('all')), {
      'aria-label': 'All numbers of the pixel',
      'aria-expanded': 'false',
    });
    this.element.append(this.body, make('div', { class: 'buttons' }, this.more, this.close));
  }

  // On small screens, where most of the numbers are left out.
  #showAll(on) {
    this.element.classList.toggle('all', on);
    this.more.setAttribute('aria-expanded', String(on));
  }

  hover(viewport, x, y, chosen) {
    const pixel = Number.isNaN(x) ? null : viewport.filmAt(x, y).map(Math.floor);
    const inside =
      pixel &&
      pixel[0] >= 0 &&
      pixel[1] >= 0 &&
      pixel[0] < viewport.picture.width &&
      pixel[1] < viewport.picture.height;
    this.viewport = viewport;
    this.at = inside ? pixel : null;
    this.element.classList.toggle('chosen', !!chosen);
    this.marked = chosen || this.app.viewports.length > 1;
    this.refresh();
  }

  // The pixel to be marked in every picture; null: none, or the pointer alone shows it.
  get mark() {
    return this.marked ? this.at : null;
  }

  // { x, y, value: { name: number }, standardError: [r, g, b] or null, ... } of a pixel; null: nothing is known.
  read(viewport, x, y) {
    const values = viewport.picture.pixel(x, y);
    if (!values) return null;
    const variance = ['variance.R', 'variance.G', 'variance.B'].map((name) => values[name]);
    const weight = values['history.weight'];
    return {
      x,
      y,
      values,
      rgb: [values.R, values.G, values.B],
      standardError: variance.every((v) => v !== undefined) ? variance.map((v) => Math.sqrt(v)) : null,
      samples: values.samples,
      historyWeight: weight,
      historyAge: weight > 0 ? values['history.age'] / weight : weight === undefined ? undefined : 0,
      bound: values['bias.bound'],
      standardErrors: viewport.picture.standardErrors(x, y),
    };
  }

  // The pixel is in the lower right part of the pictures, where the inspector would cover it.
  #isBelow() {
    const { stage } = this.viewport,
      { clientWidth, clientHeight } = stage.parentElement;
    const [x, y] = this.viewport.stageAt(...this.at);
    return stage.offsetLeft + x > clientWidth / 2 && stage.offsetTop + y > clientHeight / 2;
  }

  refresh() {
    const pixel = this.at && this.viewport && this.read(this.viewport, ...this.at);
    this.current = pixel || null;
    this.element.hidden = !pixel || !this.shown;
    if (pixel) this.element.classList.toggle('up', this.#isBelow());
    find('pixel-text').textContent = this.at ? `${this.at[0]}, ${this.at[1]}` : '';
    if (!pixel || !this.shown) return;
    const swatch = make('i');
    const gain = 2 ** this.app.look.exposure;
    swatch.style.background = `rgb(${pixel.rgb.map((v) => toSrgbByte(v * gain)).join(' ')})`;
    const colour = ({ rgb, standardError }) =>
      make(
        'div',
        { class: 'rgb' },
        ...['R', 'G', 'B'].flatMap((name, i) => [
          make('span', { text: name }),
          make('span', { text: short(rgb[i]) }),
          make('span', { text: standardError ? `± ${short(standardError[i], 3)}` : '' }),
        ]),
      );
    // Values of the same pixel in the other pictures.
    const others = this.app.viewports
      .filter((viewport) => viewport !== this.viewport)
      .flatMap((viewport) => {
        const { rgb, standardError } = this.read(viewport, ...this.at) ?? {};
        if (!rgb) return [];
        const text = rgb.map((v, i) => `${short(v, 3)}${standardError ? ` ± ${short(standardError[i], 2)}` : ''}`);
        return [make('dt', { text: viewport.name }), make('dd', { text: text.join(', ') })];
      });
    const list = [];
    const add = (name, value, digits = 4) =>
      value !== undefined && list.push(make('dt', { text: name }), make('dd', { text: short(value, digits) }));
    const { values } = pixel;
    const three = (name, keys) =>
      values[keys[0]] !== undefined &&
      list.push(make('dt', { text: name }), make('dd', { text: keys.map((key) => short(values[key], 3)).join('  ') }));
    add('samples', pixel.samples);
    if (Number.isNaN(pixel.standardErrors)) {
      list.push(make('dt', { text: 'from the pinned, in errors' }), make('dd', { text: 'not defined' }));
    } else {
      add('from the pinned, in errors', pixel.standardErrors, 3);
    }
    three('display', ['display.R', 'display.G', 'display.B']);
    add('display error', values['display.error'], 3);
    add('history weight', pixel.historyWeight, 3);
    add('history age', pixel.historyAge, 3);
    add('bias bound', pixel.bound, 3);
    add('density', values['samples.density'], 3);
    add('depth', values.Z);
    three('normal', ['N.x', 'N.y', 'N.z']);
    three('albedo', ['albedo.r', 'albedo.g', 'albedo.b']);
    this.body.replaceChildren(
      make('h2', {}, `${pixel.x}, ${pixel.y}`, swatch),
      colour(pixel),
      make('dl', {}, ...list),
      make('dl', { class: 'others' }, ...others),
    );
  }

  // For screen readers.
  sentence() {
    const { current } = this;
    if (!current) return this.at ? `Pixel ${this.at.join(', ')}: not known yet.` : '';
    const colour = ['red', 'green', 'blue'].map((name, i) => {
      const error = current.standardError ? ` plus or minus ${short(current.standardError[i], 2)}` : '';
      return `${name} ${short(current.rgb[i], 3)}${error}`;
    });
    return `Pixel ${this.at.join(', ')}: ${colour.join(', ')}.`;
  }

  // As text for the clipboard: a line for each number.
  text() {
    const { current } = this;
    if (!current) return '';
    const error = (i) => (current.standardError ? ` +- ${current.standardError[i]}` : '');
    return [
      `pixel ${current.x} ${current.y}`,
      ...['R', 'G', 'B'].map((name, i) => `${name} ${current.rgb[i]}${error(i)}`),
      ...Object.entries(current.values)
        .filter(([name]) => !/^[RGB]$/.test(name))
        .map(([name, value]) => `${name} ${value}`),
    ].join('\n');
  }
}
