// Comparisons: the present picture pinned as the reference, or a second session beside the first with the same camera.

import { button, coarse, field, make, section, select } from '../dom.js';
import { modeName, integratorName } from './render_panel.js';
import { Compare } from '../picture/compare.js';

const WAYS = [
  [Compare.NONE, 'Present picture'],
  [Compare.REFERENCE, 'Pinned picture'],
  [Compare.SPLIT, 'Split'],
  [Compare.ABSOLUTE, 'Absolute difference'],
  [Compare.RELATIVE, 'Relative difference'],
  [Compare.ERRORS, 'In standard errors'],
];

export class ComparePanel {
  constructor(app, render) {
    this.app = app;
    Object.assign(this, { modes: render.modes, integrators: render.integrators });
    this.pinButton = button('pin', 'Pin picture', () => app.pin(), { title: 'Pin as reference (P)' });
    this.unpinButton = button('unpin', 'Unpin', () => app.unpin());
    this.way = select('compare', WAYS, 0, (value) => app.setCompare(Number(value)));
    this.split = make('input', {
      id: 'split',
      type: 'range',
      min: 0,
      max: 1,
      step: 0.01,
      on: { input: () => app.moveSplit(Number(this.split.value) - app.look.split) },
    });
    this.side = button('side-by-side', 'Second session', () => app.sideBySide(!app.second), {
      'aria-pressed': 'false',
    });
    this.mode = select(
      'mode-b',
      render.modes,
      render.modes.at(-1)?.[0],
      () => this.#second(),
      'Mode of the second session',
    );
    this.integrator = select(
      'integrator-b',
      render.integrators,
      render.integrators[0]?.[0],
      () => this.#second(),
      'Integrator of the second session',
    );
    this.note = make('p', { class: 'note', id: 'compare-note' });
    this.element = section(
      'section-compare',
      'Compare',
      false,
      make('div', { class: 'row' }, this.pinButton, this.unpinButton),
      field('Show', 'compare', this.way),
      (this.splitRow = field('Split', 'split', this.split)),
      this.note,
      make('div', { class: 'row' }, this.side),
      (this.modeRow = field('Mode', 'mode-b', this.mode)),
      (this.integratorRow = field('Integrator', 'integrator-b', this.integrator)),
    );
    this.refresh();
  }

  // Settings of the second session, where they differ from the first one's.
  settings() {
    return { mode: Number(this.mode.value), integrator: Number(this.integrator.value) };
  }

  // Of the second session; false: the daemon has not both.
  choose(mode, integrator) {
    const has = (options, value) => options.some(([offered]) => offered === String(value));
    if (!has(this.modes, mode) || !has(this.integrators, integrator)) return false;
    this.mode.value = String(mode);
    this.integrator.value = String(integrator);
    return true;
  }

  #second() {
    this.app.secondSettings();
  }

  refresh() {
    const { app } = this,
      pinned = !!app.active?.picture.reference;
    this.unpinButton.disabled = !pinned;
    this.way.disabled = !pinned && app.look.compare === Compare.NONE;
    this.way.value = String(app.look.compare);
    this.splitRow.hidden = app.comparing() !== Compare.SPLIT;
    this.split.value = app.look.split;
    this.side.setAttribute('aria-pressed', String(!!app.second));
    this.modeRow.hidden = this.integratorRow.hidden = !app.second;
    this.note.textContent = !pinned
      ? `Pin a picture, then ${coarse() ? '' : 'hold X to flip to it, or '}choose a comparison.`
      : !app.active.picture.comparable
        ? 'The pinned picture has another size: it cannot be compared.'
        : `Pinned: ${app.pinnedAs}.${coarse() ? '' : ' Hold X to flip.'}`;
    const { codec } = app.connection;
    for (const viewport of app.viewports) {
      const name = viewport.stage.querySelector('.stage-name');
      name.hidden = !app.second;
      const { mode, integrator } = viewport.session.settings;
      name.textContent = `${modeName(codec, mode)} · ${integratorName(codec, integrator)}`;
    }
  }
}
