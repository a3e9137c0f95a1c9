// The row below the picture: channel, exposure, and the scale of false colours.

import { channelById, isColour } from '../web/picture/channels.js';
import { colourMap } from '../web/picture/colour_map.js';
import { make, select, short } from '../web/dom.js';

const EXPOSURES = { min: -12, max: 12, step: 0.1 };

let made = 0;

// on: channel(id), exposure(stops) while the slider moves, keepExposure(stops) when it is let go.
export class Controls {
  constructor(look, on) {
    const id = `heliograph-${++made}`;
    this.look = look;
    this.channel = select(`${id}-channel`, [], '', on.channel, 'Channel');
    this.note = make('span', { class: 'heliograph-note' });
    this.slider = make('input', {
      id: `${id}-exposure`,
      type: 'range',
      ...EXPOSURES,
      value: look.exposure,
      title: 'Double click: 0',
      on: {
        input: () => {
          on.exposure(Number(this.slider.value));
          this.#showExposure();
        },
        change: () => on.keepExposure(Number(this.slider.value)),
        dblclick: () => on.keepExposure(0),
      },
    });
    this.value = make('span', { class: 'heliograph-value' });
    this.exposure = make(
      'span',
      { class: 'heliograph-group' },
      make('label', { text: 'Exposure', htmlFor: this.slider.id }),
      this.slider,
      this.value,
    );
    this.bar = make('canvas', { width: 256, height: 1, role: 'img', 'aria-label': 'Scale of the false colours' });
    const row = new ImageData(new Uint8ClampedArray(colourMap.slice(0, 1024)), 256, 1);
    this.bar.getContext('2d').putImageData(row, 0, 0);
    this.low = make('span', { class: 'heliograph-value' });
    this.high = make('span', { class: 'heliograph-value' });
    this.scale = make('span', { class: 'heliograph-group heliograph-scale' }, this.low, this.bar, this.high);
    this.element = make('div', { class: 'heliograph-controls' }, this.channel, this.exposure, this.scale, this.note);
    this.refresh([], '');
  }

  // there: the channels that the pictures have. missing: one that was asked for and is not there.
  refresh(there, missing) {
    const { look, channel } = this,
      chosen = channelById(look.channel);
    channel.replaceChildren(
      ...(there.length ? there : [chosen]).map(({ id, name }) => make('option', { value: id, text: name })),
    );
    channel.value = look.channel;
    channel.title = chosen.about;
    this.note.textContent = missing ? `The session has no channel ${missing}.` : '';
    this.exposure.hidden = !isColour(chosen) || chosen.id === 'normal';
    this.scale.hidden = isColour(chosen);
    this.slider.value = look.exposure;
    this.#showExposure();
    this.showRange();
  }

  #showExposure() {
    const { exposure } = this.look;
    this.value.textContent = `${exposure > 0 ? '+' : ''}${exposure.toFixed(1)}`;
  }

  showRange() {
    const [low, high] = this.look.range;
    this.low.textContent = short(low, 2);
    this.high.textContent = short(high, 2);
  }
}
