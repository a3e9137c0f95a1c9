// Latencies from an input event to what it brings onto the screen, and rates of the last second.

const KEPT = 512;

export class Meter {
  #sent = []; // { id, time } of views that are not all shown
  #arrivals = [];

  constructor() {
    this.latencies = { preview: [], film: [], whole: [] }; // ms, newest last
    this.views = 0;
    this.skipped = 0;
    this.passes = [];
    this.previewPasses = [];
    this.done = { preview: 0, film: 0, whole: 0 };
    this.times = { preview: [], whole: [] };
  }

  sent(id, time) {
    this.views++;
    if (id === 1) this.#sent = [];
    if (id === 1) this.done = { preview: 0, film: 0, whole: 0 };
    this.#sent.push({ id, time });
    if (this.#sent.length > KEPT) this.#sent.shift();
  }

  received(bytes) {
    this.#arrivals.push({ time: performance.now(), bytes });
    if (this.#arrivals.length > 4096) this.#arrivals.splice(0, 2048);
  }

  // A picture of the view `id` is on the screen; kind: 'preview', 'film' (its first tile) or 'whole'.
  shown(kind, id, now) {
    this.times[kind]?.push(now);
    if (this.times[kind]?.length > KEPT) this.times[kind].shift();
    if (id <= this.done[kind]) return;
    const view = this.#sent.find((sent) => sent.id === id);
    if (kind !== 'film')
      this.skipped += this.#sent.filter((s) => s.id > Math.max(this.done.preview, this.done.whole) && s.id < id).length;
    this.done[kind] = id;
    if (!view) return;
    this.latencies[kind].push(now - view.time);
    if (this.latencies[kind].length > KEPT) this.latencies[kind].shift();
    if (kind === 'whole') this.#sent = this.#sent.filter((sent) => sent.id > id);
  }

  // Pictures and bytes in the last second.
  rates(now = performance.now()) {
    const recent = this.#arrivals.filter((arrival) => arrival.time > now - 1000);
    const bytes = recent.reduce((sum, arrival) => sum + arrival.bytes, 0);
    const pictures = [...this.times.preview, ...this.times.whole].filter((time) => time > now - 1000).length;
    return { bytes, pictures };
  }

  // Median of the newest latencies, ms; NaN: there are none.
  median(kind) {
    const sorted = this.latencies[kind].slice(-32).sort((a, b) => a - b);
    return sorted.length ? sorted[sorted.length >> 1] : NaN;
  }
}
