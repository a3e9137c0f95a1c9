// Sessions side by side: which there are, and the settings in which each differs from the others.

import { button, field, find, make, section, select } from '../dom.js';
import { say } from '../messages.js';
import { LAYERS, MOST_SESSIONS, newOwn, offeredIntegrators, offeredModes, readFields } from '../session_settings.js';

export class SessionsPanel {
  constructor(app, info) {
    this.app = app;
    const { codec } = app.connection,
      { VARIANT_PAPER } = codec.enum('Variant');
    this.modes = offeredModes(codec, info.modes);
    this.integrators = offeredIntegrators(codec, info.integrators);
    this.chosen = null;
    const change = (name) => (value) => app.setOwn(this.viewport, { [name]: Number(value) });
    this.which = select('session', [], '', (i) => this.choose(app.viewports[i]));
    this.mode = select('session-mode', this.modes, '', change('mode'));
    this.integrator = select('session-integrator', this.integrators, '', change('integrator'));
    const variants = [
      [0, 'Bounded'],
      [VARIANT_PAPER, 'As published'],
    ];
    this.variant = select('session-variant', variants, 0, change('variant'));
    this.layer = select('session-layer', LAYERS, '', (layer) => app.setOwn(this.viewport, { layer }));
    this.more = make('input', {
      id: 'session-more',
      type: 'text',
      maxLength: 200,
      placeholder: 'seed=7 roulette=throughput',
      title: 'Further fields of RenderSettings: NAME=VALUE, apart by spaces',
      on: { change: () => this.#setMore() },
    });
    this.add = button('session-add', 'Add a session', () => this.#add([this.#next()]));
    this.allModes = button('sessions-modes', 'All modes', () => this.#add(this.#missing('mode', this.modes)));
    this.allWays = button('sessions-integrators', 'All integrators', () =>
      this.#add(this.#missing('integrator', this.integrators)),
    );
    this.first = button('session-main', 'Make first', () => app.makeMain(this.viewport));
    this.close = button('session-close', 'Close', () => app.closeSession(this.viewport));
    this.group = make(
      'div',
      { class: 'group' },
      field('Session', 'session', this.which),
      field('Mode', 'session-mode', this.mode),
      field('Integrator', 'session-integrator', this.integrator),
      field('Variant', 'session-variant', this.variant),
      field('Shows', 'session-layer', this.layer),
      field('Other', 'session-more', this.more),
      make('div', { class: 'row' }, this.first, this.close),
    );
    this.element = section(
      'section-sessions',
      'Compare modes',
      false,
      make('div', { class: 'row' }, this.add),
      make('div', { class: 'row' }, this.allModes, this.allWays),
      this.group,
      make('p', {
        class: 'note',
        text:
          'The daemon shares the machine evenly between sessions that render, so equal wall time is equal work. When ' +
          'one is added or changed all begin anew. Errors are estimates of each session, of its own film.',
      }),
    );
    this.refresh();
  }

  // The session that is edited.
  get viewport() {
    const { viewports, main } = this.app;
    return viewports.includes(this.chosen) ? this.chosen : main;
  }

  choose(viewport) {
    this.chosen = viewport;
    this.refresh();
  }

  // Opens the section, for this session if it is given.
  show(viewport = this.viewport) {
    if (find('app').dataset.panel === 'closed') this.app.togglePanel();
    this.element.open = true;
    this.choose(viewport);
    (this.app.viewports.length > 1 ? this.mode : this.add).focus();
    this.element.scrollIntoView({ block: 'nearest' });
  }

  #setMore() {
    const more = this.more.value.trim().replace(/\s+/g, ' ');
    try {
      readFields(this.app.connection.codec, more);
    } catch (error) {
      say(error.message, 'error');
      return;
    }
    this.app.setOwn(this.viewport, { more });
  }

  #add(owns) {
    const added = this.app.addSessions(owns);
    if (added.length) this.choose(added[0]);
  }

  // Sessions for what none has yet.
  #missing(name, offered) {
    const { app } = this;
    const { MODE_PT } = app.connection.codec.enum('Mode');
    return offered
      .map(([value]) => Number(value))
      .filter((value) => !app.viewports.some(({ own }) => own[name] === value))
      .map((value) => (name === 'mode' ? newOwn(value, app.main.own.integrator) : newOwn(MODE_PT, value)));
  }

  #next() {
    return this.#missing('mode', this.modes).at(-1) ?? { ...this.viewport.own };
  }

  refresh() {
    const { viewports, main } = this.app,
      { own } = this.viewport;
    const several = viewports.length > 1,
      full = viewports.length >= MOST_SESSIONS;
    this.which.replaceChildren(
      ...viewports.map(({ name }, i) => make('option', { value: i, text: `${i + 1}: ${name}` })),
    );
    this.which.value = viewports.indexOf(this.viewport);
    for (const name of ['mode', 'integrator', 'layer', 'more']) this[name].value = own[name];
    this.variant.selectedIndex = own.variant > 1;
    this.close.disabled = !several;
    this.add.disabled = this.allModes.disabled = this.allWays.disabled = full;
    this.first.disabled = this.viewport === main;
  }
}
