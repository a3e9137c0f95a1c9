// One picture on the page: a session, what it shows, and the canvas with its overlay. Draws once a display frame at
// most, and returns credit for the tiles that it drew.

import { channelById, tileFormat } from './picture/channels.js';
import { Meter } from './meter.js';
import { Picture } from './picture/picture.js';
import { plain, Session } from './protocol/session.js';
import { sessionName } from './session_settings.js';
import { Tile } from './tile.js';
import { ZOOMS } from './url_state.js';

const VARIANCE_EVERY = 4; // tiles of a place, on slow links
const LATE_MS = 120; // from an input event to its preview
const LONGEST_WAIT_MS = 1000; // for the first session's film, after the last move

export class Viewport {
  #pending = 0; // tiles that were taken and not drawn yet
  #frame = 0;
  #previewFrames = new Set();
  #lastDrawn = { preview: 0, film: 0, whole: 0 };
  #newWhole = false;
  #moveTimer = 0;
  #picture = ''; // what the film shows and how, as text
  #secondsBefore = 0; // of frames that went on with it
  #sessionId = '';
  #anew = true; // the stream's film begins at nothing
  #follows = 0; // timer: takes the newest view when it ends; 0: has it
  #watchers = []; // viewports that show the preview that is being received
  #turn = 0; // of the others, the one that shows a preview where these come late

  // own: the settings of this session alone (session_settings.js). app: look, camera, link, callbacks.
  constructor(app, own) {
    this.app = app;
    this.own = own;
    this.tile = new Tile(app, this);
    this.stage = this.tile.element;
    this.canvas = this.stage.querySelector('.picture');
    this.overlay = this.stage.querySelector('.overlay');
    this.look = Object.create(app.look, { channel: { get: () => this.#channel } });
    this.behind = false; // shows the first session's previews until its own film of the view begins
    this.trouble = this.stopReason = ''; // why the session gives no pictures; why it waits for the daemon
    this.points = []; // [seconds, error] of the present picture, for the plot
    this.meter = new Meter();
    this.extra = new Set(); // parts of TileFormat that were asked for besides the shown channel
    this.moving = false;
    this.progress = null;
    this.end = null;
    this.unsampled = [];
    this.settings = null; // in force
    this.told = new Set(); // notices of this scene's pictures, each told once
    this.listeners = new Set(); // called with (what): 'begin', 'progress', 'end', 'whole', 'drawn', 'tile'
    this.picture = new Picture(this.canvas, this.look, (lost) => {
      if (this.closed) return;
      app.say(
        lost
          ? 'The graphics context was lost; the picture comes back when the browser gives it back.'
          : 'The graphics context is back.',
        lost ? 'error' : 'good',
      );
      this.invalidate();
    });
    this.session = new Session(app.connection, app.scenes, {
      opened: ({ session_id: id, resumed }) => {
        this.#pending = 0;
        this.#anew = !resumed || id !== this.#sessionId;
        this.#sessionId = id;
        if (this.#anew) this.#previewFrames.clear();
      },
      frameBegin: (begin) => this.#begin(begin),
      tile: (tile, bytes) => this.#tile(tile, bytes),
      frameEnd: (end) => this.#end(end),
      progress: (progress) => {
        this.progress = this.#inAll(progress);
        this.#tell('progress');
      },
      notice: (severity, text) => app.say(text, severity >= 2 ? 'error' : 'info'),
      problem: (sentence, kind) => app.problem(this, sentence, kind),
      settings: (settings, budget) => app.refused(this, settings, budget),
      view: (camera) => app.viewRefused(this, camera),
      stopped: (sentence) => app.stopped(this, sentence),
    });
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.stage);
    this.resize();
  }

  // Ends the session, and gives back what the picture holds.
  close() {
    this.closed = true;
    clearTimeout(this.#follows);
    this.session.close();
    this.observer.disconnect();
    this.overlay.blur(); // no key is held any more
    this.stage.remove();
    this.picture.loseContext();
  }

  // Which channel is shown: the one that all share, or this session's own layer in place of film and display.
  get #channel() {
    const { channel } = this.app.look,
      { layer } = this.own;
    if (!layer || !['display', 'radiance'].includes(channel)) return channel;
    return layer === 'oidn' ? 'display' : layer;
  }

  #tell(what) {
    for (const listener of this.listeners) listener(what);
  }

  resize() {
    const ratio = devicePixelRatio,
      { clientWidth, clientHeight } = this.stage;
    this.ratio = ratio;
    this.overlay.width = Math.max(1, Math.round(clientWidth * ratio));
    this.overlay.height = Math.max(1, Math.round(clientHeight * ratio));
    this.place();
    this.app.onResize?.(this);
  }

  // All of the picture is shown.
  get fit() {
    return this.app.frame === null;
  }

  // Puts the picture where the shared frame has it; on whole pixels of the screen where each of its own is a whole
  // number of them.
  place() {
    const { picture, overlay } = this,
      { frame } = this.app;
    if (picture.width) {
      let zoom = frame?.zoom ?? Math.min(overlay.width / picture.width, overlay.height / picture.height);
      if (!frame && Math.abs(zoom - 1) < 0.02 && zoom >= 1) zoom = 1;
      const [u, v] = frame?.centre ?? [0.5, 0.5];
      const origin = [overlay.width / 2 - u * picture.width * zoom, overlay.height / 2 - v * picture.height * zoom];
      picture.zoom = zoom;
      picture.origin = frame && zoom % 1 ? origin : origin.map(Math.round);
    }
    this.invalidate();
  }

  // A picture that is enlarged as a whole is drawn a pixel for each of its own, and the browser enlarges it: that takes
  // a fraction of the time, which counts where no graphics card draws. Otherwise the canvas is as large as the stage.
  #sizeCanvas() {
    const { picture, canvas, overlay, ratio } = this;
    const enlarged = this.fit && picture.width > 0 && picture.zoom >= 1;
    const [x, y] = enlarged ? picture.origin : [0, 0];
    const [width, height] = enlarged ? [picture.width, picture.height] : [overlay.width, overlay.height];
    const zoom = enlarged ? picture.zoom : 1;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const style = {
      left: `${x / ratio}px`,
      top: `${y / ratio}px`,
      width: `${(width * zoom) / ratio}px`,
      height: `${(height * zoom) / ratio}px`,
      imageRendering: enlarged && !picture.smooth(zoom) ? 'pixelated' : 'auto',
    };
    for (const [name, value] of Object.entries(style)) if (canvas.style[name] !== value) canvas.style[name] = value;
    return enlarged;
  }

  // The point of the picture in the middle of the stage, in parts of its sides.
  get #centre() {
    return this.app.frame?.centre ?? [0.5, 0.5];
  }

  // Zooms by a factor around a point of the stage, CSS pixels from its corner.
  zoomBy(factor, x, y) {
    const { picture, overlay, ratio } = this;
    if (!picture.width) return;
    const zoom = Math.min(Math.max(picture.zoom * factor, ZOOMS[0]), ZOOMS[1]);
    const [cx, cy] = this.#centre,
      moved = 1 / picture.zoom - 1 / zoom;
    this.app.setFrame({
      zoom,
      centre: [
        cx + ((x * ratio - overlay.width / 2) * moved) / picture.width,
        cy + ((y * ratio - overlay.height / 2) * moved) / picture.height,
      ],
    });
  }

  showOneToOne() {
    this.zoomBy(1 / this.picture.zoom, this.stage.clientWidth / 2, this.stage.clientHeight / 2);
  }

  // Film pixels [x0, y0, x1, y1] as large as they fit.
  showBox([x0, y0, x1, y1]) {
    const { picture, overlay } = this;
    const zoom = Math.min(overlay.width / (x1 - x0), overlay.height / (y1 - y0), ZOOMS[1]);
    this.app.setFrame({ zoom, centre: [(x0 + x1) / 2 / picture.width, (y0 + y1) / 2 / picture.height] });
  }

  shift(dx, dy) {
    const { picture, ratio } = this,
      [cx, cy] = this.#centre;
    this.app.setFrame({
      zoom: picture.zoom,
      centre: [
        cx - (dx * ratio) / (picture.zoom * picture.width),
        cy - (dy * ratio) / (picture.zoom * picture.height),
      ],
    });
  }

  // Film coordinates of a point of the stage in CSS pixels.
  filmAt(x, y) {
    const { picture, ratio } = this;
    return [(x * ratio - picture.origin[0]) / picture.zoom, (y * ratio - picture.origin[1]) / picture.zoom];
  }

  // The point of the stage in CSS pixels that shows these film coordinates.
  stageAt(x, y) {
    const { picture, ratio } = this;
    return [(x * picture.zoom + picture.origin[0]) / ratio, (y * picture.zoom + picture.origin[1]) / ratio];
  }

  // The same as [-1, 1], v up.
  uvAt(x, y) {
    const [fx, fy] = this.filmAt(x, y);
    return [(2 * fx) / this.picture.width - 1, 1 - (2 * fy) / this.picture.height];
  }

  get name() {
    return sessionName(this.app.connection.codec, this.own);
  }

  // { rmse, relmse } of what the session is to show by its own estimate; relmse of the film alone. null: not known.
  get error() {
    const { film } = this.picture;
    const { error } = this.progress ?? {};
    if (!this.own.layer || this.own.layer === 'radiance') return error?.known && error.rmse > 0 ? error : null;
    const plane = this.own.layer === 'display' && film?.planes.get('display.error');
    if (!plane || !this.picture.whole || this.picture.under) return null;
    let sum = 0;
    for (let y = 0; y < film.height; y++)
      for (let x = 0; x < film.width; x++) sum += film.at('display.error', x, y) ** 2;
    const rmse = Math.sqrt(sum / (film.width * film.height));
    return rmse > 0 && rmse < Infinity ? { rmse } : null;
  }

  // The mode carries samples of earlier pictures over.
  get carries() {
    const { MODE_COMBINED, MODE_REPROJECT } = this.app.connection.codec.enum('Mode');
    return [MODE_COMBINED, MODE_REPROJECT].includes(this.session.settings.mode);
  }

  get aspect() {
    return this.picture.width / this.picture.height || 1;
  }

  format() {
    const { link } = this.app;
    const needs = new Set(['variance', 'samples', ...channelById(this.look.channel).needs, ...this.extra]);
    const { codec } = this.app.connection,
      { COMPRESSION_ZIP } = codec.enum('Compression');
    return tileFormat(needs, {
      display_denoiser: needs.has('display') && this.own.layer === 'oidn' ? codec.enum('Denoiser').DENOISER_OIDN : 0,
      preview_jpeg: link.jpeg ? link.jpegQuality : 0,
      compression: link.zip ? COMPRESSION_ZIP : 0,
      variance_every: link.slow ? VARIANCE_EVERY : 0,
    });
  }

  // Where nothing of a picture has come yet over a link that proves to be slow, a preview by JPEG is shown first.
  refreshFormat() {
    const { picture, session } = this;
    const nothing = !picture.whole && !picture.under;
    session.setFormat(this.format(), nothing && this.app.link.jpeg && session.settings.preview_rate > 0);
  }

  // The camera moved by an input event of this time (performance.now()).
  sendView(inputTime) {
    this.setMoving();
    if (!this.session.wanted && !document.hidden && this.app.resume(this)) return;
    this.session.gaze = this.app.gaze.at;
    const id = this.session.setView(this.app.cameraMessage(), this.app.look.exposure);
    if (id) this.meter.sent(id, inputTime);
  }

  // The camera moves: shows the first session's previews of it, and takes the view once that begins its film, which is
  // when the camera rests.
  follow() {
    this.setMoving();
    this.behind = true;
    clearTimeout(this.#follows);
    this.#follows = setTimeout(() => this.catchUp(), LONGEST_WAIT_MS);
  }

  catchUp() {
    if (!this.#follows) return;
    clearTimeout(this.#follows);
    this.#follows = 0;
    this.sendView(performance.now());
  }

  setMoving() {
    this.moving = true;
    clearTimeout(this.#moveTimer);
    this.#moveTimer = setTimeout(() => {
      this.moving = false;
    }, 400);
  }

  // The other sessions' pictures that show the next preview: one in turn where previews come late, as where no
  // graphics card draws, else all.
  #followers() {
    const { viewports, main } = this.app;
    const others = this === main ? viewports.filter((viewport) => viewport !== this && viewport.behind) : [];
    const late = this.meter.median('preview') > LATE_MS;
    return late && others.length ? [others[this.#turn++ % others.length]] : others;
  }

  // Another stream, as for another channel, is another frame, but its film goes on where it was: so does its time.
  #goOn(begin) {
    const picture = plain([begin.settings, this.session.view, this.app.scenes.current?.scene_id]);
    this.continued = picture === this.#picture && !this.#anew;
    this.#anew = false;
    this.#picture = picture;
    this.#secondsBefore = this.continued ? (this.progress?.seconds ?? this.#secondsBefore) : 0;
  }

  // Names of a frame, '' where its view is not known. samples: of its samples, which previews and the region
  // do not change; picture: of what is to be seen, whatever the samples (modes that carry pictures over choose a seed
  // for each).
  #namesOf({ tag, settings }) {
    const view = this.session.viewOf(tag.view_id);
    if (!view) return { samples: '', picture: '' };
    const { preview_rate, preview_budget_ms, preview_upscaling, region, ...rest } = settings;
    const shown = [view, this.app.scenes.current?.scene_id];
    const { seed, ...others } = rest;
    return {
      samples: plain([rest, ...shown]),
      picture: plain([this.carries ? others : rest, region, ...shown]),
    };
  }

  #inAll(progress) {
    progress.seconds += this.#secondsBefore;
    return progress;
  }

  #begin(begin) {
    if (begin.preview) {
      this.#previewFrames.add(begin.tag.frame);
      this.#watchers = [this, ...this.#followers()];
      for (const { picture } of this.#watchers) picture.beginPreview(begin);
      this.previewBytes = 0;
      this.previewStart = performance.now();
    } else {
      this.#goOn(begin);
      this.settings = begin.settings;
      this.unsampled = begin.unsampled;
      this.trouble = '';
      if (!this.#follows && begin.tag.view_id === this.session.viewId) {
        this.behind = false;
        if (this === this.app.main) for (const viewport of this.app.viewports) viewport.catchUp();
      }
      this.end = null;
      this.progress = null;
      const { width, height } = this.picture;
      const { samples, picture } = this.#namesOf(begin);
      this.picture.beginFilm(begin, samples, picture);
      if (this.picture.width !== width || this.picture.height !== height) this.place();
      for (const text of begin.notices) {
        const kind = text.replace(/[\d.]+(e[+-]?\d+)?/g, '#'); // one notice, whatever its numbers
        if (!this.told.has(kind)) this.app.say(text, 'info');
        this.told.add(kind);
      }
      this.#tell('begin');
    }
    this.app.onSize?.(this);
  }

  #tile(tile, bytes) {
    this.#pending++;
    this.meter.received(bytes, tile.preview);
    try {
      if (tile.preview) {
        this.previewBytes += bytes;
        for (const { picture } of this.#watchers) picture.addPreviewTile(tile);
        this.app.counters.previewTiles++;
        // Shown, and its credit returned, with the whole preview: but it must not wait for what it alone returns.
        if (2 * this.#pending >= this.session.credit) this.#returnCredit();
        return;
      } else {
        this.app.counters.filmTiles++;
        if (this.picture.addTile(tile)) this.#newWhole = true;
        this.#lastDrawn.film = tile.tag.view_id;
        this.#tell('tile');
      }
    } catch (error) {
      this.app.say(`A tile could not be read: ${error.message}.`, 'error');
    }
    this.invalidate();
  }

  async #end(end) {
    if (this.#previewFrames.delete(end.tag.frame)) {
      const { END_REASON_PREVIEW } = this.app.connection.codec.enum('EndReason');
      if (end.reason !== END_REASON_PREVIEW) {
        this.invalidate();
        return;
      }
      this.app.link.measured(this.previewBytes, performance.now() - this.previewStart);
      this.meter.previewPasses = end.passes;
      const gain = 2 ** this.session.exposure;
      for (const viewport of this.#watchers)
        if (viewport.behind) viewport.picture.showPreview({ revision: Infinity }, gain).then(() => viewport.place());
      await this.picture.showPreview(end.tag, gain);
      this.#lastDrawn.preview = end.tag.view_id;
      this.app.counters.previews++;
      this.place();
      return;
    }
    this.end = end;
    if (end.totals) this.progress = this.#inAll(end.totals);
    this.meter.passes = end.passes;
    this.#tell('end');
    const { END_REASON_FAILED } = this.app.connection.codec.enum('EndReason');
    if (end.reason === END_REASON_FAILED) this.app.say(`The picture failed: ${end.message}`, 'error');
  }

  #returnCredit() {
    this.session.drawn(this.#pending);
    this.#pending = 0;
  }

  invalidate() {
    this.#frame ||= requestAnimationFrame(() => this.#draw());
  }

  #draw() {
    this.#frame = 0;
    this.picture.draw(this.#sizeCanvas());
    this.app.drawOverlay?.(this);
    this.#returnCredit();
    const now = performance.now();
    const { preview, film } = this.#lastDrawn;
    if (preview) this.meter.shown('preview', preview, now);
    if (film) this.meter.shown('film', film, now);
    this.#lastDrawn.preview = this.#lastDrawn.film = 0;
    if (this.#newWhole) {
      this.#newWhole = false;
      this.app.counters.whole++;
      this.meter.shown('whole', this.picture.viewId, now);
      this.#tell('whole');
    }
    this.#tell('drawn');
  }
}
