// The link to the daemon: its limit in bytes a second, given or measured; how previews are coded; and the figures of
// the head-up display.

import { canInflate, loadInflate } from '../picture/exr.js';
import { bytes, check, field, find, make, ms, number, section, select, short } from '../dom.js';

const SLOW = 4e6; // bytes a second below which previews come as JPEG
const ENOUGH = 2e5; // bytes of previews after which a slow link may prove faster
const FASTER_AT_MOST = 1.5; // times
const LEAST = 5e4;
const NOTABLE = 0.3; // relative change of the rate that the daemon is told of
const FAR = 2; // times off: told at once
const REPORTS = 5; // of which the median counts
const LEAST_REPORTS = 3;
const REPORT_MS = 20000; // after which one counts no more
// A link that has just borne this is not slow: a browser that lacks processor time holds answers up, too.
const FAST = { bytes: 2e6, rate: 8e6, forMs: 30000 };
const LIMITS = [
  ['auto', 'Measured'],
  ['0', 'None'],
  ['10e6', '10 MB/s'],
  ['3e6', '3 MB/s'],
  ['1e6', '1 MB/s'],
  ['3e5', '300 kB/s'],
];

const time = (seconds) => (seconds < 1 ? `${(seconds * 1000).toFixed(1)} ms` : `${short(seconds, 3)} s`);

// Of the link, as the viewports need it.
export class Link {
  #previews = { bytes: 0, seconds: 0 }; // that came since the rate was set
  #reports = []; // { rate, time } of the daemon since then
  #burst = { bytes: 0, since: 0 };
  #fastUntil = 0; // performance.now()

  // onChange(): what depends on the link has changed. settled(): all that is to be seen has come once.
  constructor(onChange, settled = () => true) {
    this.settled = settled;
    this.choice = 'auto';
    this.coding = 'auto'; // of previews: auto, exr, jpeg
    this.jpegQuality = 75;
    this.rate = 0; // measured, bytes a second; 0: fast enough
    this.onChange = onChange;
  }

  // Budget.bytes_per_second
  get limit() {
    return this.choice === 'auto' ? (this.rate ? 0.9 * this.rate : 0) : Number(this.choice);
  }
  get slow() {
    return this.limit > 0 && this.limit < SLOW;
  }
  get jpeg() {
    return this.coding === 'jpeg' || (this.coding === 'auto' && this.slow);
  }

  // Compressed tiles are asked for once they can be read.
  get zip() {
    return this.slow && canInflate();
  }

  // One change for both, since each opens another stream: compressed tiles and the rest.
  #changed() {
    if (!this.slow || canInflate()) this.onChange();
    else loadInflate().then(this.onChange, this.onChange); // without it they come as they are
  }

  // A message of so many bytes has come.
  received(size, now = performance.now()) {
    const burst = this.#burst;
    burst.bytes += size;
    if (burst.bytes < FAST.bytes) return;
    if (burst.bytes > (FAST.rate * (now - burst.since)) / 1000) {
      this.#fastUntil = now + FAST.forMs;
      if (this.rate) this.#setRate(SLOW);
    }
    this.#burst = { bytes: 0, since: now };
  }

  // The daemon tells that the link takes no more than this, and holds pictures up. Reports of a short while differ
  // much: a picture that has not come once is disturbed only where they are far off.
  heldUp(rate) {
    const time = performance.now();
    if (this.choice !== 'auto' || (!this.rate && rate >= SLOW) || time < this.#fastUntil) return;
    const recent = this.#reports.filter((report) => time - report.time < REPORT_MS);
    this.#reports = [...recent, { rate, time }].slice(-REPORTS);
    const sorted = this.#reports.map((report) => report.rate).sort((a, b) => a - b);
    const median = sorted[sorted.length >> 1];
    const far = !this.rate || median > FAR * this.rate || median < this.rate / FAR;
    if (far || (sorted.length >= LEAST_REPORTS && this.settled())) this.#setRate(median);
  }

  // A preview of so many bytes took so long from its first to its last byte. The daemon is told to send no more than the
  // link took, so nothing is held up any more: that it takes more by now is seen by previews alone.
  measured(size, milliseconds) {
    if (!this.rate || this.choice !== 'auto') return;
    const previews = this.#previews;
    previews.bytes += size;
    previews.seconds += Math.max(milliseconds / 1000, 1e-3);
    if (previews.bytes < ENOUGH) return;
    const rate = previews.bytes / previews.seconds;
    this.#previews = { bytes: 0, seconds: 0 };
    if (rate > this.rate) this.#setRate(Math.min(rate, FASTER_AT_MOST * this.rate));
  }

  #setRate(rate) {
    this.#previews = { bytes: 0, seconds: 0 };
    this.#reports = [];
    const next = rate >= SLOW ? 0 : Math.max(rate, LEAST);
    if (Math.abs(next - this.rate) <= NOTABLE * this.rate) return;
    this.rate = next;
    this.#changed();
  }

  set(values) {
    Object.assign(this, values);
    if (values.choice) this.rate = 0;
    this.#changed();
  }
}

export class LinkPanel {
  constructor(app) {
    this.app = app;
    const { link } = app;
    this.limit = select('link-limit', LIMITS, link.choice, (choice) => link.set({ choice }));
    this.coding = select(
      'preview-coding',
      [
        ['auto', 'Automatic'],
        ['exr', 'EXR, half'],
        ['jpeg', 'JPEG'],
      ],
      link.coding,
      (coding) => link.set({ coding }),
    );
    this.quality = number(
      'jpeg-quality',
      link.jpegQuality,
      (value) => link.set({ jpegQuality: Math.min(100, Math.max(1, Number(value) || 75)) }),
      { min: 1, max: 100 },
    );
    this.note = make('p', { class: 'note', id: 'link-note' });
    this.hud = check('hud-shown', 'Latency and rates over the picture (I)', false, (on) => this.showHud(on));
    this.element = section(
      'section-link',
      'Link',
      false,
      field('Limit', 'link-limit', this.limit),
      field('Previews', 'preview-coding', this.coding),
      field('JPEG quality', 'jpeg-quality', this.quality),
      this.hud,
      this.note,
    );
    setInterval(() => this.refresh(), 500);
  }

  showHud(on) {
    find('hud').hidden = !on;
    this.hud.firstChild.checked = on;
    this.refresh();
  }

  // Figures of a viewport; also window.heliograph's.
  figures(viewport) {
    const { meter, progress } = viewport,
      { bytes: rate, pictures } = meter.rates();
    return {
      preview: meter.median('preview'),
      film: meter.median('film'),
      whole: meter.median('whole'),
      pictures,
      bytesPerSecond: rate,
      skipped: meter.skipped,
      samplesPerSecond: progress?.samples_per_second ?? 0,
      reuse: progress?.reuse_share ?? 0,
      passes: meter.passes.map(({ pass, seconds }) => [pass, seconds]),
      previewPasses: meter.previewPasses.map(({ pass, seconds }) => [pass, seconds]),
    };
  }

  refresh() {
    const { link } = this.app;
    const measured = link.rate ? `Measured: ${bytes(link.rate)}/s. ` : '';
    this.note.textContent = link.slow
      ? `${measured}Previews are JPEG; until a picture is done, one tile in four has its variance.`
      : measured;
    const hud = find('hud');
    if (hud.hidden || document.hidden) return;
    const f = this.figures(this.app.active);
    const rows = [
      ['input to preview', ms(f.preview)],
      ['to film tile', ms(f.film)],
      ['to whole picture', ms(f.whole)],
      ['pictures / s', f.pictures],
      ['received / s', bytes(f.bytesPerSecond)],
      ['skipped views', f.skipped],
      ['samples / s', f.samplesPerSecond ? `${short(f.samplesPerSecond / 1e6, 3)} M` : '–'],
      ['carried over', `${Math.round(100 * f.reuse)} %`],
      ...f.passes.map(([pass, seconds]) => [pass.replace('_', ' '), time(seconds)]),
      ...f.previewPasses.map(([pass, seconds]) => [`${pass === 'preview' ? '' : 'preview '}${pass}`, time(seconds)]),
    ];
    hud.replaceChildren(
      make('dl', {}, ...rows.flatMap(([name, value]) => [make('dt', { text: name }), make('dd', { text: value })])),
    );
  }
}
