// The camera in numbers: cameras of the scene, angle of view, lens, bookmarks.

import { button, field, make, number, section, select, short } from '../dom.js';
import { fromMessage, scale, add } from '../camera/vectors.js';

const DEGREES = 180 / Math.PI;

export class CameraPanel {
  constructor(app) {
    this.app = app;
    const change = (optics) => {
      app.camera.set(optics);
      app.moved(performance.now());
      this.refresh();
    };
    this.cameras = select('scene-camera', [], '', (value) => this.#go(Number(value)));
    this.angle = make('input', {
      id: 'fov',
      type: 'range',
      min: 2,
      max: 150,
      step: 0.5,
      on: { input: () => change({ vertical_fov: Number(this.angle.value) / DEGREES }) },
    });
    this.angleText = make('span', { class: 'value' });
    this.lens = number('lens-radius', 0, (value) => change({ lens_radius: Math.max(0, Number(value) || 0) }), {
      min: 0,
      step: 'any',
    });
    this.focus = number(
      'focus-distance',
      1,
      (value) => change({ focus_distance: Math.max(1e-9, Number(value) || 1) }),
      { min: 0, step: 'any' },
    );
    this.camerasRow = field('Of the scene', 'scene-camera', this.cameras);
    this.angleRow = field('Angle', 'fov', this.angle, this.angleText);
    this.element = section(
      'section-camera',
      'Camera',
      false,
      this.camerasRow,
      this.angleRow,
      field('Lens radius', 'lens-radius', this.lens),
      field('Focused at', 'focus-distance', this.focus),
      make(
        'div',
        { class: 'row' },
        button('camera-reset', 'Reset', () => app.resetCamera(), { title: 'Reset (R)' }),
        button('focus-here', 'Focus here', () => app.pickFocus(), {
          title: 'Focus the lens on the inspected pixel, or the middle of the picture (F)',
        }),
        button('orbit-here', 'Orbit here', () => app.pickPivot(...app.inspected), {
          title: 'Orbit around what the inspected pixel shows, or the middle of the picture (O)',
        }),
      ),
      make('p', {
        class: 'note',
        text: 'Here: the inspected pixel, or the middle. Shift and a digit sets a bookmark, the digit goes there.',
      }),
    );
    this.element.addEventListener('toggle', () => this.refresh());
  }

  opened() {
    const { cameras } = this.app.scenes.loaded;
    this.cameras.replaceChildren(
      ...cameras.map((camera, i) => make('option', { value: i, text: camera.name || `camera ${i}` })),
    );
    this.camerasRow.hidden = cameras.length < 2;
    this.refresh();
  }

  #go(i) {
    const { loaded } = this.app.scenes;
    const centre = scale(add(fromMessage(loaded.bounds_min ?? {}), fromMessage(loaded.bounds_max ?? {})), 0.5);
    this.app.camera.read(loaded.cameras[i].view, centre);
    this.app.moved(performance.now());
    this.refresh();
  }

  refresh() {
    if (!this.element.open) return;
    const { camera } = this.app,
      { vertical_fov, lens_radius, focus_distance } = camera.optics;
    this.angleRow.hidden = camera.orthographic;
    this.angle.value = (vertical_fov || 0.8) * DEGREES;
    this.angleText.textContent = `${((vertical_fov || 0.8) * DEGREES).toFixed(1)}°`;
    this.lens.value = short(lens_radius || 0);
    this.focus.value = short(focus_distance || 1);
  }
}
