// What of the picture is shown and how: channel, exposure, tone mapping, range of false colours, zoom; and the scale.

import { channelById, channels, isColour } from '../picture/channels.js';
import { colourMap } from '../picture/colour_map.js';
import { button, check, field, find, make, section, select, short } from '../dom.js';
import { Histogram } from './histogram.js';
import { Compare, Relation } from '../picture/compare.js';
import { ToneMap } from '../picture/shaders.js';

const EXPOSURES = { min: -12, max: 12, step: 0.1 };

// The state that all pictures share.
export function newLook() {
  return {
    channel: 'display',
    exposure: 0,
    toneMap: ToneMap.CLIP,
    range: [0.001, 1],
    autoRange: true,
    logarithmic: true,
    filter: 'auto',
    compare: Compare.NONE,
    split: 0.5,
    floor: 1e-4,
  };
}

export class PicturePanel {
  constructor(app) {
    this.app = app;
    const { look } = app;
    this.channel = select(
      'channel',
      channels.map((c) => [c.id, c.name]),
      look.channel,
      (id) => app.setChannel(id),
    );
    this.exposure = make('input', {
      id: 'exposure',
      type: 'range',
      ...EXPOSURES,
      value: look.exposure,
      on: { input: () => app.setExposure(Number(this.exposure.value)), dblclick: () => app.setExposure(0) },
    });
    this.exposureText = make('span', { class: 'value', id: 'exposure-value' });
    this.toneMap = select(
      'tone-map',
      [
        [ToneMap.CLIP, 'sRGB, clipped'],
        [ToneMap.FILMIC, 'Filmic'],
        [ToneMap.REINHARD, 'Reinhard'],
        [ToneMap.FALSE_COLOUR, 'False colour'],
      ],
      look.toneMap,
      (value) => {
        look.toneMap = Number(value);
        this.#changed();
      },
    );
    this.low = this.#bound('range-low', 0);
    this.high = this.#bound('range-high', 1);
    this.auto = check('range-auto', 'Automatic', look.autoRange, (on) => {
      look.autoRange = on;
      this.#changed();
    });
    this.log = check('range-log', 'Logarithmic', look.logarithmic, (on) => {
      look.logarithmic = on;
      this.#changed();
    });
    this.filter = select(
      'filter',
      [
        ['auto', 'Automatic'],
        ['nearest', 'Nearest'],
        ['linear', 'Linear'],
      ],
      look.filter,
      (value) => {
        look.filter = value;
        this.#changed();
      },
    );
    this.histogram = new Histogram(app);
    this.about = make('p', { class: 'note', id: 'channel-about' });
    this.rangeRow = make(
      'div',
      { class: 'group', id: 'range' },
      field('Range', 'range-low', this.low, this.high),
      make('div', { class: 'row' }, this.auto, this.log),
    );
    this.element = section(
      'section-picture',
      'Picture',
      true,
      field('Channel', 'channel', this.channel),
      this.about,
      (this.exposureRow = field('Exposure', 'exposure', this.exposure, this.exposureText)),
      (this.toneRow = field('Tone map', 'tone-map', this.toneMap)),
      this.rangeRow,
      this.histogram.canvas,
      field('Filter', 'filter', this.filter),
      make(
        'div',
        { class: 'row' },
        button('fit', 'Fit', () => app.setFrame(null), { title: 'Fit (0)' }),
        button('one-to-one', '1:1', () => app.active.showOneToOne(), { title: 'One to one (Shift 0)' }),
        button('zoom-in', '+', () => app.zoom(1.5), { 'aria-label': 'Zoom in' }),
        button('zoom-out', '−', () => app.zoom(1 / 1.5), { 'aria-label': 'Zoom out' }),
      ),
      make(
        'div',
        { class: 'row' },
        button('tool-zoom', 'Zoom box', () => app.useTool('zoom'), {
          title: 'Draw the box to zoom to (Z)',
          'aria-pressed': 'false',
        }),
        button('tool-hand', 'Move', () => app.useTool('hand'), {
          title: 'Drags move the enlarged picture (H)',
          'aria-pressed': 'false',
        }),
      ),
      make(
        'div',
        { class: 'row' },
        button('noisiest', 'Noisiest', () => app.inspectNoisiest(), {
          title: 'Inspect the pixel of the highest standard error in the noisiest block of 16 × 16 that is shown (G)',
        }),
        button('copy-pixel', 'Copy pixel', () => app.copyPixel(), { title: 'Copy the inspected pixel (C)' }),
      ),
      make(
        'div',
        { class: 'row' },
        button('save-png', 'Save PNG', () => app.save('png')),
        button('save-exr', 'Save EXR', () => app.save('exr')),
        button('copy-link', 'Copy link', () => app.copyLink()),
      ),
    );
    const bar = find('scale-bar').getContext('2d');
    this.bars = [0, 1].map(
      (row) => new ImageData(new Uint8ClampedArray(colourMap.slice(row * 1024, row * 1024 + 1024)), 256, 1),
    );
    this.drawBar = (row) => bar.putImageData(this.bars[row], 0, 0);
    this.refresh();
  }

  #changed() {
    this.refresh();
    this.app.saveState();
  }

  #bound(id, end) {
    const input = make('input', {
      id,
      type: 'number',
      step: 'any',
      'aria-label': end ? 'Upper bound' : 'Lower bound',
      on: {
        change: () => {
          const { look } = this.app;
          look.range[end] = Number(input.value);
          look.autoRange = false;
          this.#changed();
        },
      },
    });
    return input;
  }

  // Says how the picture is shown in words: the false colours' quantity, or '' where there are none.
  scaleName() {
    const { look } = this.app,
      channel = channelById(look.channel),
      compares = this.app.comparing();
    if (compares === Compare.ABSOLUTE) return `${channel.name}: absolute difference`;
    if (compares === Compare.RELATIVE) return `${channel.name}: relative difference`;
    if (compares === Compare.ERRORS && isColour(channel)) {
      return `Radiance: difference in standard errors; ${this.#relation()}`;
    }
    if (compares === Compare.ERRORS) return `${channel.name}: absolute difference`;
    if (!isColour(channel)) return channel.name;
    return look.toneMap === ToneMap.FALSE_COLOUR && channel.id !== 'normal' ? `${channel.name}: luminance` : '';
  }

  // How the samples of the two pictures compared are related, in words.
  #relation() {
    const { picture, carries } = this.app.active;
    if (picture.relation === Relation.NESTED) return 'of one film, whose samples the two share; chequered: not defined';
    const why = carries
      ? '; samples carried over may be in both, which makes it too small'
      : picture.relation === Relation.SEED
        ? '; the two have one seed, which may make it too small'
        : '';
    return `the two are taken as independent${why}`;
  }

  refresh() {
    const { app } = this,
      { look } = app,
      channel = channelById(look.channel);
    const inErrors = app.comparing() === Compare.ERRORS && isColour(channel);
    if (inErrors) {
      this.keptRange ??= [...look.range];
      look.range = [-4, 4];
    } else if (this.keptRange) {
      look.range = this.keptRange;
      this.keptRange = null;
    }
    const name = this.scaleName();
    this.channel.value = look.channel;
    this.exposure.value = look.exposure;
    this.exposureText.textContent = `${look.exposure > 0 ? '+' : ''}${look.exposure.toFixed(1)}`;
    this.toneMap.value = look.toneMap;
    this.filter.value = look.filter;
    this.about.textContent = channel.about;
    const colour = isColour(channel) && channel.id !== 'normal';
    this.exposureRow.hidden = this.toneRow.hidden = !colour;
    this.rangeRow.hidden = !name || inErrors;
    this.low.value = short(look.range[0], 3);
    this.high.value = short(look.range[1], 3);
    this.auto.firstChild.checked = look.autoRange;
    this.log.firstChild.checked = look.logarithmic;
    find('scale').hidden = !name || !app.scenes.current;
    if (name) {
      this.drawBar(inErrors ? 1 : 0);
      const [low, high] = look.range;
      const at = (t) => (look.logarithmic && !inErrors ? low * (high / low) ** t : low + (high - low) * t);
      find('scale-ticks').replaceChildren(
        ...[0, 0.25, 0.5, 0.75, 1].map((t) => make('span', { text: short(at(t), 2) })),
      );
      find('scale-name').textContent = name;
    }
    app.redraw();
  }

  // Fits the range of false colours to the picture: from the 1st to the 99th percentile of what is shown.
  measure() {
    const { look } = this.app;
    const values = this.histogram.measure();
    if (!look.autoRange || !this.scaleName() || this.keptRange || !values) return;
    const [low, high] = values;
    const range = look.logarithmic ? [Math.max(low, high * 1e-3, 1e-12), Math.max(high, 1e-11)] : [low, high];
    if (range[0] >= range[1]) range[1] = range[0] * 1.01 + 1e-9;
    if (range.every((value, i) => Math.abs(value - look.range[i]) < 0.03 * Math.abs(look.range[i]))) return;
    look.range = range;
    this.refresh();
  }
}
