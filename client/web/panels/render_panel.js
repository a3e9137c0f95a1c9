// How the daemon renders: mode, integrator, budget, size, region, seed, previews.

import { offeredFoveations, offeredIntegrators, offeredModes } from '../session_settings.js';
import { RANGES } from '../url_state.js';
import { button, field, make, number, section, select, short } from '../dom.js';

const SIZES = [
  ['window', 'Window'],
  ['screen', 'Window, screen pixels'],
  ['half', 'Window, half'],
  ['640x360', '640 × 360'],
  ['960x540', '960 × 540'],
  ['1280x720', '1280 × 720'],
  ['1920x1080', '1920 × 1080'],
  ['custom', 'Other …'],
];

export class RenderPanel {
  // info: GetServerInfoResponse
  constructor(app, info) {
    this.app = app;
    const { codec } = app.connection,
      { wanted } = app;
    const change = (name) => (value) => app.setSettings({ [name]: Number(value) });
    const budget = (name) => (value) => app.setBudget({ [name]: Math.max(0, Number(value) || 0) });
    const own = (name) => (value) => app.setOwn(app.main, { [name]: Number(value) });
    this.mode = select('mode', offeredModes(codec, info.modes), '', own('mode'));
    this.integrator = select('integrator', offeredIntegrators(codec, info.integrators), '', own('integrator'));
    this.samples = number('budget-samples', '', budget('samples'), {
      min: 0,
      max: RANGES.samples[1],
      step: 1,
      placeholder: '∞',
      title: 'Samples a pixel',
    });
    this.time = number('budget-time', '', budget('time_s'), {
      min: 0,
      max: RANGES.time_s[1],
      step: 'any',
      placeholder: '∞',
      title: 'Seconds',
    });
    this.error = number('budget-error', '', budget('error'), {
      min: 0,
      max: RANGES.error[1],
      step: 'any',
      placeholder: 'none',
      title: 'Standard error, radiance',
    });
    this.size = select('size', SIZES, wanted.size, (value) => app.setSize(value));
    this.custom = make('input', {
      id: 'size-custom',
      type: 'text',
      placeholder: '800x600',
      'aria-label': 'Width x height',
      on: { change: () => /^\d+x\d+$/.test(this.custom.value) && app.setSize(this.custom.value) },
    });
    this.seed = number(
      'seed',
      wanted.seed,
      (value) => app.setSettings({ seed: Number(value) }),
      { min: 0, max: RANGES.seed[1], step: 1 },
    );
    this.segments = number('max-segments', '', (value) => app.setSettings({ max_segments: Number(value) || 0 }), {
      min: 1,
      max: 65535,
      step: 1,
    });
    this.rate = number('preview-rate', wanted.preview_rate, change('preview_rate'), { min: 0, max: 120, step: 1 });
    this.previewBudget = number('preview-budget', '', change('preview_budget_ms'), { min: 5, max: 1000, step: 5 });
    this.previewBudget.placeholder = '45';
    this.foveation = select('foveation', offeredFoveations(codec), '', change('foveation'));
    this.foveation.title =
      'Samples go where you look: the pointer, a pixel that keys or a tap inspect, a pinned point. ' +
      'As published: previews alone are made around it, by the method of Mrad (2022), a baseline to compare with';
    this.pin = button('gaze-pin', 'Pin', () => app.gaze.pin(), {
      'aria-label': 'Pin the gaze',
      title: 'The gaze stays at its point (L)',
    });
    this.upscaling = select(
      'preview-upscaling',
      [
        ['0', 'Every pixel'],
        ['1', 'A quarter, and edges'],
      ],
      '',
      change('preview_upscaling'),
    );
    this.upscaling.title = 'Where previews trace surfaces';
    this.region = button('tool-region', 'Region', () => app.useTool('region'), {
      title: 'Draw the box to be rendered (B)',
      'aria-pressed': 'false',
    });
    this.clear = button('region-clear', 'Whole film', () => app.setSettings({ region: null }));
    this.notes = make('p', { class: 'note', id: 'render-notes' });
    this.element = section(
      'section-render',
      'Render',
      true,
      field('Mode', 'mode', this.mode),
      field('Integrator', 'integrator', this.integrator),
      field('Size', 'size', this.size),
      (this.customRow = field('', 'size-custom', this.custom)),
      field('Samples', 'budget-samples', this.samples),
      field('Seconds', 'budget-time', this.time),
      field('Target error', 'budget-error', this.error),
      make('div', { class: 'row' }, this.region, this.clear),
      make(
        'details',
        { id: 'render-more', class: 'more' },
        make('summary', { text: 'More' }),
        make(
          'div',
          { class: 'group' },
          field('Segments', 'max-segments', this.segments),
          field('Seed', 'seed', this.seed),
          field('Previews / s', 'preview-rate', this.rate),
          field('Preview, ms', 'preview-budget', this.previewBudget),
          field('Preview rays', 'preview-upscaling', this.upscaling),
          field('Foveation', 'foveation', this.foveation),
          (this.pinRow = field('Gaze', 'gaze-pin', this.pin)),
        ),
      ),
      this.notes,
    );
    this.refresh();
  }

  refresh() {
    const { wanted, budget } = this.app;
    const { own } = this.app.main;
    this.mode.value = String(own.mode);
    this.integrator.value = String(own.integrator);
    this.samples.value = budget.samples || '';
    this.time.value = budget.time_s || '';
    this.error.value = budget.error ? short(budget.error, 3) : '';
    this.seed.value = wanted.seed;
    this.segments.value = wanted.max_segments || '';
    this.segments.placeholder = String(this.app.main?.settings?.max_segments ?? 10);
    this.rate.value = wanted.preview_rate;
    this.previewBudget.value = wanted.preview_budget_ms || '';
    const { gaze } = this.app;
    this.foveation.value = gaze.on ? String(wanted.foveation) : '0';
    this.pinRow.hidden = !gaze.on;
    this.pin.setAttribute('aria-pressed', String(gaze.pinned));
    this.upscaling.value = String(wanted.preview_upscaling);
    this.size.value = SIZES.some(([value]) => value === wanted.size) ? wanted.size : 'custom';
    this.customRow.hidden = this.size.value !== 'custom';
    if (!this.customRow.hidden && /\d/.test(wanted.size)) this.custom.value = wanted.size;
    this.clear.disabled = !wanted.region;
    this.notes.textContent = (this.app.main?.unsampled ?? []).join(' ');
  }
}
