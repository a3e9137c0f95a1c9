// Comparisons of the present picture with one that was pinned as the reference.

import { button, coarse, field, make, section, select } from '../dom.js';
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
  constructor(app) {
    this.app = app;
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
    this.note = make('p', { class: 'note', id: 'compare-note' });
    this.element = section(
      'section-compare',
      'Compare',
      false,
      make('div', { class: 'row' }, this.pinButton, this.unpinButton),
      field('Show', 'compare', this.way),
      (this.splitRow = field('Split', 'split', this.split)),
      this.note,
    );
    this.refresh();
  }

  refresh() {
    const { app } = this,
      pinned = !!app.active?.picture.reference;
    this.unpinButton.disabled = !pinned;
    this.way.disabled = !pinned && app.look.compare === Compare.NONE;
    this.way.value = String(app.look.compare);
    this.splitRow.hidden = app.comparing() !== Compare.SPLIT;
    this.split.value = app.look.split;
    this.note.textContent = !pinned
      ? `Pin a picture, then ${coarse() ? '' : 'hold X to flip to it, or '}choose a comparison.`
      : !app.active.picture.comparable
        ? 'The pinned picture has another size: it cannot be compared.'
        : `Pinned: ${app.pinnedAs}.${coarse() ? '' : ' Hold X to flip.'}`;
  }
}
