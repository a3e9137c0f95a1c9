// A session on the daemon and its stream: sends views, settings and budgets, hands on frames and tiles, and returns
// credit for tiles that were drawn. Goes on after a lost connection: attached again while the session lives, made again
// from the page's own state when it does not.

import { CallError, Code } from './connection.js';

const GRACE_S = 60;
const RETRY_S = 3;
const LONGEST_RETRY_S = 60;
const RESTART_S = 0.5; // between two tries to attach again to a daemon that restarts
const LONGEST_RESTART_MS = 60000;
const LONGEST_TURN_MS = 1000;
const VIEWS = 256; // sent, and not known to have given a picture: kept at most

// Sessions are made one after the other, each with its stream: a full daemon ends sessions that have none yet.
let turn = Promise.resolve();

// A message as text.
export const plain = (value) => JSON.stringify(value, (name, v) => (typeof v === 'bigint' ? String(v) : v));
const differs = (a, b) => plain(a) !== plain(b);

// Tiles of a whole picture that may be on their way: two of each, so that the daemon need not wait for the page.
export function creditFor({ width, height }) {
  return Math.min(65536, Math.max(16, 2 * Math.ceil(width / 128) * Math.ceil(height / 128)));
}

// handlers: opened(opened), frameBegin, tile(tile, bytes), frameEnd, progress, notice(severity, text),
// problem(sentence, kind) with kind 'error', 'info' or 'good', settings(settings in force), view(CameraView to go back
// to; null: none is known), stopped(sentence): there are no pictures until the daemon is ready again; '': there are.
export class Session {
  #stream = null;
  #id = '';
  #credit = 0;
  #sent = {};
  #timer = 0;
  #running = false;
  #good = []; // { settings, budget } that gave pictures, the newest last: two at most
  #goodView = null; // the newest that gave a picture
  #views = new Map(); // sent since, by id
  #retry_s = RETRY_S;
  #stopped = false;
  #hadOne = false; // a session that the daemon may have lost
  #closed = false;
  #passOn = () => {}; // the next session's turn begins
  #asked = false; // for the session that is to be made
  #restartEnds = 0; // of a daemon that restarts: when its session is looked for no longer so often; 0: none does

  constructor(connection, scenes, handlers) {
    this.connection = connection;
    this.scenes = scenes; // scenes.js: makes the scene again on a daemon that has lost it
    this.handlers = handlers;
    this.settings = {};
    this.budget = {};
    this.format = {};
    this.view = null; // CameraView
    this.exposure = 0;
    this.gaze = null; // { x, y }: of the views that are sent; null: none
    this.viewId = 0;
    this.wanted = false; // a stream is wanted: not paused, not hidden
    this.attached = false;
    this.fallback = true; // to path tracing, once, where the daemon refuses the first settings
  }

  get id() {
    return this.#id;
  }

  setView(camera, exposure) {
    this.view = camera;
    this.exposure = exposure;
    if (!this.attached) {
      if (this.wanted && !this.#timer) this.#run(); // a refusal had ended it
      return 0;
    }
    this.#sendView(camera, exposure);
    this.#views.set(this.viewId, camera);
    if (this.#views.size > VIEWS) this.#views.delete(this.#views.keys().next().value);
    return this.viewId;
  }

  #sendView(camera, exposure) {
    const gaze = this.gaze ? { gaze: this.gaze } : {};
    this.#stream.send({ view: { id: ++this.viewId, camera, exposure, ...gaze } });
  }

  // Of the newest view, without another picture. True: the daemon was told now; what it knows it is not told again.
  moveGaze(gaze) {
    const known = gaze?.x === this.gaze?.x && gaze?.y === this.gaze?.y;
    this.gaze = gaze;
    if (known || !this.attached || !this.viewId) return false;
    this.#stream.send({ gaze: gaze ? { gaze } : {} });
    return true;
  }

  // The CameraView that was sent with this number; undefined: none that is known.
  viewOf(id) {
    return this.#views.get(id);
  }

  setSettings(settings) {
    this.settings = settings;
    this.#sync();
  }

  setBudget(budget) {
    this.budget = budget;
    this.#sync();
  }

  // The scene that scenes.js has now.
  switchScene() {
    this.#sync();
  }

  // Channels and coding of tiles: known at the opening of a stream alone, so that a change opens another one.
  // previewFirst: the picture is to be begun again by a preview.
  setFormat(format, previewFirst = false) {
    if (JSON.stringify(format) === JSON.stringify(this.format)) return;
    this.format = format;
    if (this.attached) this.#attach(previewFirst);
  }

  // Starts, or goes on with, the stream.
  run() {
    this.wanted = true;
    this.#closed = false;
    return this.#run();
  }

  // Waits no longer for the time to try again.
  tryNow() {
    this.#retry_s = RETRY_S;
    return this.#run();
  }

  // Renders nothing until run(); the session lives on for its grace time.
  rest() {
    this.wanted = false;
    this.#again(null);
    this.#tellStopped('');
    const stream = this.#stream;
    this.#stream = null;
    this.attached = false;
    stream?.send({ close: {} });
  }

  // Begins anew, with another session that knows nothing of earlier pictures.
  async restart() {
    const id = this.#id;
    if (!id || this.#running) {
      this.#sync();
      return;
    }
    this.#running = true; // until the daemon has room for the new one
    this.#again(null);
    this.#stream?.send({ close: {} });
    this.#stream = null;
    this.attached = false;
    this.#id = '';
    this.#asked = true;
    await this.connection.call('close_session', { session_id: id }).catch(() => {});
    this.#running = false;
    this.#run();
  }

  // Ends the session on the daemon.
  close() {
    this.wanted = false;
    this.#closed = true;
    this.#again(null);
    this.#tellStopped('');
    if (this.attached) this.#stream.send({ close: { close_session: true } });
    else if (this.#id) this.connection.call('close_session', { session_id: this.#id }).catch(() => {});
    this.#stream = null;
    this.attached = false;
    this.#id = '';
    this.#hadOne = false;
    this.#good = [];
    this.#goodView = null;
  }

  // The daemon may send as many more tiles.
  drawn(tiles) {
    if (this.attached && tiles > 0) this.#stream.send({ credit: { tiles: Math.min(tiles, 65536) } });
  }

  // The stream was opened with credit for so many tiles.
  get credit() {
    return this.#credit;
  }

  async #run() {
    if (this.#running || this.attached || !this.wanted || this.connection.state !== 'open') return;
    this.#running = true;
    this.#again(null);
    try {
      if (!this.#id) await this.#create();
      if (this.#closed) this.close();
      else if (this.wanted) this.#attach();
    } catch (error) {
      this.#failed(error);
    } finally {
      if (!this.attached) this.#passOn();
      this.#running = false;
    }
  }

  async #create() {
    const before = turn;
    turn = new Promise((resolve) => {
      this.#passOn = resolve;
    });
    await before;
    setTimeout(this.#passOn, LONGEST_TURN_MS);
    if (!this.wanted) return;
    const again = this.#hadOne;
    const scene = again ? await this.scenes.ensure() : this.scenes.current;
    let { settings } = this;
    const { budget } = this;
    const request = { scene_id: scene.scene_id, settings, budget, grace_s: GRACE_S };
    let answer;
    try {
      answer = await this.connection.call('create_session', request);
    } catch (error) {
      const { MODE_PT } = this.connection.codec.enum('Mode');
      if (error.code !== Code.INVALID_ARGUMENT || again || !this.fallback) throw error;
      this.fallback = false;
      this.settings = settings = { ...this.settings, mode: MODE_PT };
      answer = await this.connection.call('create_session', { ...request, settings });
      this.handlers.settings(settings, budget);
      this.handlers.problem(`Mode path tracing, since the daemon refused the other: ${error.message}`, 'info');
    }
    this.#id = answer.session_id;
    this.#hadOne = true;
    this.#sent = { scene: scene.scene_id, settings, budget };
    this.viewId = 0;
    this.#views.clear();
    if (again && !this.#asked) {
      this.handlers.problem('The daemon no longer had the session: made again from this page.', 'good');
    }
    this.#asked = false;
  }

  #attach(previewFirst = false) {
    this.#credit = creditFor(this.settings);
    const old = this.#stream;
    const stream = this.connection.stream('stream_frames', {
      message: (answer, bytes) => stream === this.#stream && this.#receive(answer, bytes),
      end: (status, lost) => stream === this.#stream && this.#ended(status, lost),
    });
    this.#stream = stream;
    this.attached = true;
    stream.send({ open: { session_id: this.#id, format: this.format, credit: this.#credit } });
    old?.cancel();
    this.#sync();
    if (!this.view) return;
    // The daemon makes previews of views that are new to it: one that differs by its focus alone goes ahead.
    if (previewFirst) {
      const { view, exposure } = this,
        focus = view.focus_distance || 1;
      const camera = { ...view, focus_distance: focus * (focus > 1 ? 1 - 1e-6 : 1 + 1e-6) }; // within its range
      this.#sendView(camera, exposure);
      this.#views.set(this.viewId, view);
    }
    this.setView(this.view, this.exposure);
  }

  // What is wanted is not what gave pictures.
  get #changed() {
    const { settings, budget } = this;
    return this.#good.length > 0 && differs(this.#good.at(-1), { settings, budget });
  }

  // Tells the daemon what has changed since it was told.
  #sync() {
    if (!this.attached) {
      if (this.wanted) this.#run();
      return;
    }
    const { settings, budget } = this,
      scene = this.scenes.current.scene_id;
    const more = creditFor(settings) - this.#credit;
    if (more > 0) {
      this.#stream.send({ credit: { tiles: more } });
      this.#credit += more;
    }
    if (this.#sent.scene !== scene) this.#stream.send({ scene: { scene_id: scene } });
    if (differs(this.#sent.settings, settings)) this.#stream.send({ settings });
    if (differs(this.#sent.budget, budget)) this.#stream.send({ budget });
    this.#sent = { scene, settings, budget };
  }

  #receive(answer, bytes) {
    const { handlers } = this;
    if (answer.tile) {
      handlers.tile(answer.tile, bytes);
    } else if (answer.frame_begin) {
      this.#works(answer.frame_begin.tag.view_id);
      handlers.frameBegin(answer.frame_begin);
    } else if (answer.frame_end) {
      handlers.frameEnd(answer.frame_end);
    } else if (answer.progress) {
      handlers.progress(answer.progress);
    } else if (answer.opened) {
      this.#passOn();
      handlers.opened(answer.opened);
    } else if (answer.notice) {
      handlers.notice(answer.notice.severity, answer.notice.text);
    }
  }

  // A picture of a view began: what was sent is in force, or what was sent before it.
  #works(viewId) {
    this.#retry_s = RETRY_S;
    this.#restartEnds = 0;
    this.#tellStopped('');
    this.#goodView = this.#views.get(viewId) ?? this.#goodView;
    for (const id of this.#views.keys()) if (id < viewId) this.#views.delete(id);
    const { settings, budget } = this.#sent;
    const now = { settings, budget };
    if (!differs(this.#good.at(-1), now)) return;
    this.#good = [...this.#good.slice(-1), now];
  }

  // The daemon refused what was sent: what was in force before is wanted again. False: nothing was.
  #goBack() {
    const { settings, budget } = this;
    const now = { settings, budget };
    this.#good = this.#good.filter((good) => differs(good, now));
    const good = this.#good.at(-1);
    if (!good) return false;
    Object.assign(this, good);
    this.#sent = { ...this.#sent, ...good };
    this.handlers.settings(good.settings, good.budget);
    return true;
  }

  // The daemon refused a view: the newest one that gave a picture is wanted again. False: there is none.
  #viewRefused() {
    const good = this.#goodView;
    this.#goodView = null; // goes back to it once
    this.#views.clear();
    if (good) this.view = good;
    this.handlers.view(good);
    return good !== null;
  }

  // Tries again after so many seconds; null: not any more.
  #again(seconds) {
    clearTimeout(this.#timer);
    this.#timer = 0;
    if (seconds === null) return;
    this.#timer = setTimeout(() => {
      this.#timer = 0;
      this.#run();
    }, seconds * 1000);
  }

  #tellStopped(sentence) {
    if (!sentence && !this.#stopped) return;
    this.#stopped = sentence !== '';
    this.handlers.stopped(sentence);
  }

  // There are no pictures for now: tries again, later each time.
  #stop(sentence) {
    this.#tellStopped(sentence);
    this.#again(this.#retry_s);
    this.#retry_s = Math.min(2 * this.#retry_s, LONGEST_RETRY_S);
  }

  // The daemon said that it restarts, and may still be at it.
  get #restarts() {
    this.#restartEnds ||= performance.now() + LONGEST_RESTART_MS;
    return performance.now() < this.#restartEnds;
  }

  #ended(status, lost) {
    this.#stream = null;
    this.attached = false;
    if (!this.wanted) return;
    this.#failed(new CallError(status, lost));
  }

  #failed(error) {
    const { handlers } = this;
    if (error.lost || this.connection.state !== 'open') return; // goes on with the connection
    switch (error.code) {
      case Code.NOT_FOUND:
        if (this.#id) {
          this.#id = '';
          this.#again(0);
        } else {
          this.#stop(`The daemon no longer has the scene: ${error.message}`);
        }
        break;
      case Code.ABORTED:
        this.wanted = false;
        handlers.problem('Another window has taken this session over. Move the camera to take it back.', 'error');
        break;
      case Code.INVALID_ARGUMENT:
        handlers.problem(error.message, 'error');
        if (/^view\b/.test(error.message) ? this.#viewRefused() : this.#goBack()) this.#again(0);
        break;
      case Code.RESOURCE_EXHAUSTED:
        if (!/try again/i.test(error.message) && this.#changed && this.#goBack()) {
          handlers.problem(error.message, 'error');
          this.#again(0);
          break;
        }
        this.#stop(`The daemon is full: ${error.message}`);
        break;
      case Code.UNAVAILABLE:
        if (/try again/i.test(error.message) && this.#restarts) {
          this.#tellStopped('The daemon restarts, and this picture goes on there. Reconnecting …');
          this.#again(RESTART_S);
          break;
        }
        this.#stop(`The daemon is stopping: ${error.message}. Save what you have`);
        break;
      case Code.OK:
        this.#again(RETRY_S);
        break;
      case Code.CANCELLED: // by a daemon that goes away
        if (this.#restartEnds && this.#restarts) this.#again(RESTART_S);
        else this.#stop(error.message);
        break;
      default:
        this.#stop(error.message);
    }
  }
}
