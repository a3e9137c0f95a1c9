// Edits of the scene: materials, lights, objects and the environment, from lists of what the daemon can edit.

import { button, field, make, number, section, short } from '../dom.js';
import { fromMessage, toMessage } from '../camera/vectors.js';
import { placeOf, transformOf, turnedAndScaled } from '../camera/transform.js';
import { toLinear, toSrgbByte } from '../picture/srgb.js';

const DELAY_MS = 120; // between the edits of one that is dragged
const LONG = 30; // rows of a list from which on it can be filtered

const hex = (rgb) => `#${rgb.map((v) => toSrgbByte(v).toString(16).padStart(2, '0')).join('')}`;
const unhex = (text) => [1, 3, 5].map((i) => toLinear(parseInt(text.slice(i, i + 2), 16) / 255));

const emits = (m) => Object.values(m.emission ?? {}).some((value) => value > 0);

export class ScenePanel {
  #timer = 0;
  #queue = Promise.resolve();

  constructor(app) {
    this.app = app;
    this.lists = make('div', { id: 'scene-lists', class: 'group' });
    this.facts = make('p', { class: 'note', id: 'scene-facts' });
    this.notices = make('details', { id: 'scene-notices', class: 'more', hidden: true });
    this.undo = button('edits-reset', 'Undo all edits', () => this.#reset());
    this.element = section(
      'section-scene',
      'Scene',
      false,
      this.facts,
      this.notices,
      this.lists,
      make('div', { class: 'row' }, this.undo),
    );
    this.element.addEventListener('toggle', () => this.#fill());
    this.filledFor = '';
  }

  // A scene was opened. notices: of its loading.
  opened(notices) {
    this.filledFor = '';
    this.notices.open = false;
    this.notices.hidden = !notices.length;
    this.notices.replaceChildren(
      make('summary', { text: notices.length === 1 ? '1 notice' : `${notices.length} notices` }),
      ...notices.map((text) => make('p', { class: 'note', text })),
    );
    const { current } = this.app.scenes;
    this.facts.textContent =
      `${current.triangles.toLocaleString('en')} triangles, ${current.materials} materials, ` +
      `${current.lights} lights, ${current.instances} objects.`;
    this.#fill();
  }

  async #fill() {
    const { scenes } = this.app;
    this.undo.disabled = !scenes.edits.length;
    if (!this.element.open || !scenes.loaded || this.filledFor === scenes.loaded.scene_id) return;
    this.filledFor = scenes.loaded.scene_id;
    try {
      this.found = { objects: [], materials: [], lights: [] };
      await this.#more();
    } catch (error) {
      this.filledFor = '';
      this.lists.replaceChildren(
        make('p', { class: 'note', text: `The daemon tells nothing to edit: ${error.message}` }),
      );
    }
  }

  // The lists' next part: of each as many as the daemon tells at a time.
  async #more() {
    const { found } = this,
      id = this.filledFor;
    const answer = await this.app.connection.call('describe_scene', {
      scene_id: id,
      first_object: found.objects.length,
      first_material: found.materials.length,
      first_light: found.lights.length,
    });
    if (id !== this.filledFor || found !== this.found) return;
    for (const name of ['objects', 'materials', 'lights']) found[name].push(...answer[name]);
    this.#show(found, answer);
  }

  // totals: of the lists; found: what is known of them.
  #show(found, totals) {
    const filters = this.filters ?? {};
    this.filters = {};
    const group = (title, id, count, rows, whole = true) => {
      if (!rows.length) return [];
      const parts = [make('div', { class: 'label note', text: `${title} (${count})` })];
      if (rows.length > LONG || !whole) parts.push(this.#filter(title, id, rows, filters[id]));
      parts.push(make('div', { class: 'list', id }, ...rows));
      if (!whole) {
        const more = () => this.#more().catch((error) => this.app.say(error.message, 'error'));
        parts.push(make('div', { class: 'row' }, button(`${id}-more`, 'More', more)));
      }
      return parts;
    };
    const materials = found.materials.map((m, i) => [m, this.#material(m, i)]);
    const of = (shining) => materials.filter(([m]) => emits(m) === shining).map(([, row]) => row);
    const lights = [...of(true), ...found.lights.map((l, i) => this.#light(l, i))];
    const objects = found.objects.map((o, i) => this.#object(o, i));
    const environment = found.environment ?? totals.environment;
    found.environment = environment;
    const allMaterials = found.materials.length >= totals.material_total;
    const allLights = found.lights.length >= totals.light_total;
    const allObjects = found.objects.length >= totals.object_total;
    this.lists.replaceChildren(
      ...group('Lights', 'lights', lights.length, lights, allLights),
      ...group('Environment', 'environment', 1, environment ? [this.#environment(environment)] : []),
      ...group('Materials', 'materials', totals.material_total - of(true).length, of(false), allMaterials),
      ...group('Objects', 'objects', totals.object_total, objects, allObjects),
    );
  }

  // Shows those rows of a list whose name has the text that is typed.
  #filter(title, id, rows, before = '') {
    const input = make('input', {
      id: `${id}-filter`,
      type: 'search',
      placeholder: 'Filter',
      'aria-label': `${title}: filter`,
      value: before,
      on: { input: () => apply() },
    });
    const apply = () => {
      const text = input.value.toLowerCase();
      this.filters[id] = input.value;
      for (const row of rows) row.hidden = !row.firstChild.textContent.toLowerCase().includes(text);
    };
    apply();
    return input;
  }

  // A row that opens. build(change, now): what is in it; now: the edit as it stands.
  #row(id, title, kind, target, build) {
    const key = `${kind}:${target?.index ?? ''}`;
    const body = make('div');
    const row = make('details', { id }, make('summary', { text: title, title }), body);
    const stored = () => this.app.scenes.editOf(key)?.[kind] ?? {};
    const change = (values) => {
      row.classList.add('edited');
      this.#later(key, { [kind]: { ...(target ?? {}), ...stored(), ...this.pending?.[key], ...values } }, values);
    };
    row.classList.toggle('edited', !!this.app.scenes.editOf(key));
    row.addEventListener(
      'toggle',
      () => row.open && !body.childNodes.length && body.append(...build(change, stored())),
      { once: true },
    );
    return row;
  }

  #later(key, edit, values) {
    this.pending ??= {};
    this.pending[key] = { ...this.pending[key], ...values };
    this.waiting ??= new Map();
    this.waiting.set(key, edit);
    this.#timer ||= setTimeout(() => {
      this.#timer = 0;
      const edits = [...this.waiting];
      this.waiting.clear();
      this.#queue = this.#queue.then(async () => {
        for (const [name, one] of edits) {
          await this.app.edit(name, one);
          if (this.pending[name] && !this.waiting.has(name)) delete this.pending[name];
        }
        this.undo.disabled = !this.app.scenes.edits.length;
      });
    }, DELAY_MS);
  }

  // A colour and how strong it is; strongest: 1 for reflectances.
  #colour(id, label, rgb, change, limited) {
    const peak = limited ? 1 : Math.max(...rgb, 0);
    const strength = number(`${id}-strength`, short(peak, 4), () => say(), {
      min: 0,
      step: 'any',
      'aria-label': `${label}: strength`,
    });
    const colour = make('input', {
      id,
      type: 'color',
      value: hex(peak > 0 ? rgb.map((v) => v / peak) : [1, 1, 1]),
      on: { input: () => say() },
    });
    const say = () =>
      change(toMessage(unhex(colour.value).map((v) => v * (limited ? 1 : Math.max(0, Number(strength.value) || 0)))));
    return limited ? field(label, id, colour) : field(label, id, colour, strength);
  }

  #material(m, i) {
    return this.#row(`material-${i}`, m.name || `material ${i}`, 'material', { index: i }, (change, now) => {
      const rows = [make('p', { class: 'note', text: m.model.replaceAll('_', ' ') })];
      const colour = now.base_color ?? m.base_color,
        emission = now.emission ?? m.emission,
        roughness = now.roughness ?? m.roughness;
      if (colour)
        rows.push(
          this.#colour(
            `material-${i}-color`,
            'Colour',
            fromMessage(colour),
            (base_color) => change({ base_color }),
            true,
          ),
        );
      if (emission) {
        const row = this.#colour(`material-${i}-emission`, 'Emission', fromMessage(emission), (value) =>
          change({ emission: value }),
        );
        rows.splice(emits(m) ? 1 : rows.length, 0, row); // of a lamp it is what is meant
      }
      if (roughness !== undefined) {
        const slider = make('input', {
          id: `material-${i}-roughness`,
          type: 'range',
          min: 0,
          max: 1,
          step: 0.01,
          value: roughness,
          on: { input: () => change({ roughness: Number(slider.value) }) },
        });
        rows.push(field('Roughness', slider.id, slider));
      }
      if (rows.length === 1) rows.push(make('p', { class: 'note', text: 'Nothing of it can be edited.' }));
      return rows;
    });
  }

  #light(l, i) {
    return this.#row(`light-${i}`, `${l.name || `light ${i}`} · ${l.kind}`, 'light', { index: i }, (change, now) => [
      this.#colour(`light-${i}-intensity`, 'Intensity', fromMessage(now.intensity ?? l.intensity ?? {}), (intensity) =>
        change({ intensity }),
      ),
    ]);
  }

  #environment(radiance) {
    return this.#row('environment-edit', 'Environment', 'environment', null, (change, now) => [
      this.#colour('environment-radiance', 'Radiance', fromMessage(now.radiance ?? radiance), (value) =>
        change({ radiance: value }),
      ),
    ]);
  }

  // Place, turn about the vertical and size, on top of the object's transform as it is now.
  #object(o, i) {
    return this.#row(`object-${i}`, o.name || `object ${i}`, 'object', { index: i }, (change, now) => {
      const base = transformOf(now.transform ?? o.transform);
      const inputs = ['x', 'y', 'z'].map((axis, k) =>
        number(`object-${i}-${axis}`, short(placeOf(base)[k], 6), () => say(), { step: 'any', 'aria-label': axis }),
      );
      const turn = make('input', {
        id: `object-${i}-turn`,
        type: 'range',
        min: -180,
        max: 180,
        step: 1,
        value: 0,
        on: { input: () => say() },
      });
      const size = number(`object-${i}-size`, 1, () => say(), { min: 0.001, step: 'any' });
      const say = () => {
        const angle = (Number(turn.value) * Math.PI) / 180,
          s = Math.max(1e-3, Number(size.value) || 1);
        const place = inputs.map((input) => Number(input.value) || 0);
        change({ transform: turnedAndScaled(base, angle, s, place) });
      };
      return [
        make('p', { class: 'note', text: `${o.triangles.toLocaleString('en')} triangles` }),
        field('Position', inputs[0].id, ...inputs),
        field('Turn', turn.id, turn),
        field('Size', size.id, size),
      ];
    });
  }

  async #reset() {
    await this.#queue;
    await this.app.edit(null, null);
    this.filledFor = '';
    this.#fill();
  }
}
