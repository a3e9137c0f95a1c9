// A session on the daemon and its stream: sends views, settings and budgets, hands on frames and tiles, and returns
// credit for tiles that were drawn. Goes on after a lost connection: attached again while the session lives, made again
// from the page's own state when it does not.

import { CallError, Code } from './connection.js';

const GRACE_S = 60;
const RETRY_S = 3;

// A message as text.
export const plain = (value) => JSON.stringify(value, (name, v) => (typeof v === 'bigint' ? String(v) : v));
const differs = (a, b) => plain(a) !== plain(b);

// Tiles of a whole picture that may be on their way: two of each, so that the daemon need not wait for the page.
export function creditFor({ width, height }) {
  return Math.min(65536, Math.max(16, 2 * Math.ceil(width / 128) * Math.ceil(height / 128)));
}

// handlers: opened(opened), frameBegin, tile(tile, bytes), frameEnd, progress, notice(severity, text),
// problem(sentence, kind) with kind 'error', 'info' or 'good', settings(settings in force).
export class Session {
  #stream = null;
  #id = '';
  #credit = 0;
  #sent = {};
  #timer = 0;
  #running = false;
  #good = []; // { settings, budget } that gave pictures, the newest last: two at most
  #hadOne = false; // a session that the daemon may have lost
  #fallback = true;

  constructor(connection, scenes, handlers) {
    this.connection = connection;
    this.scenes = scenes; // scenes.js: makes the scene again on a daemon that has lost it
    this.handlers = handlers;
    this.settings = {};
    this.budget = {};
    this.format = {};
    this.view = null; // CameraView
    this.exposure = 0;
    this.viewId = 0;
    this.wanted = false; // a stream is wanted: not paused, not hidden
    this.attached = false;
  }

  get id() {
    return this.#id;
  }

  setView(camera, exposure) {
    this.view = camera;
    this.exposure = exposure;
    if (!this.attached) return 0;
    this.#stream.send({ view: { id: ++this.viewId, camera, exposure } });
    return this.viewId;
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
  setFormat(format) {
    if (JSON.stringify(format) === JSON.stringify(this.format)) return;
    this.format = format;
    if (this.attached) this.#attach();
  }

  // Starts, or goes on with, the stream.
  run() {
    this.wanted = true;
    return this.#run();
  }

  // Renders nothing until run(); the session lives on for its grace time.
  rest() {
    this.wanted = false;
    clearTimeout(this.#timer);
    const stream = this.#stream;
    this.#stream = null;
    this.attached = false;
    stream?.send({ close: {} });
  }

  // Ends the session on the daemon.
  close() {
    this.wanted = false;
    clearTimeout(this.#timer);
    if (this.attached) this.#stream.send({ close: { close_session: true } });
    else if (this.#id) this.connection.call('close_session', { session_id: this.#id }).catch(() => {});
    this.#stream = null;
    this.attached = false;
    this.#id = '';
    this.#hadOne = false;
    this.#good = [];
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
    clearTimeout(this.#timer);
    try {
      if (!this.#id) await this.#create();
      if (this.wanted) this.#attach();
    } catch (error) {
      this.#failed(error);
    } finally {
      this.#running = false;
    }
  }

  async #create() {
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
      if (error.code !== Code.INVALID_ARGUMENT || again || !this.#fallback) throw error;
      this.#fallback = false;
      this.settings = settings = { ...this.settings, mode: MODE_PT };
      answer = await this.connection.call('create_session', { ...request, settings });
      this.handlers.settings(settings, budget);
      this.handlers.problem(`Mode path tracing, since the daemon refused the other: ${error.message}`, 'info');
    }
    this.#id = answer.session_id;
    this.#hadOne = true;
    this.#sent = { scene: scene.scene_id, settings, budget };
    this.viewId = 0;
    if (again) this.handlers.problem('The daemon no longer had the session: made again from this page.', 'good');
  }

  #attach() {
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
    if (this.view) this.setView(this.view, this.exposure);
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
      this.#works();
      handlers.frameBegin(answer.frame_begin);
    } else if (answer.frame_end) {
      handlers.frameEnd(answer.frame_end);
    } else if (answer.progress) {
      handlers.progress(answer.progress);
    } else if (answer.opened) {
      handlers.opened(answer.opened);
    } else if (answer.notice) {
      handlers.notice(answer.notice.severity, answer.notice.text);
    }
  }

  // A picture began: what was sent is in force, or what was sent before it.
  #works() {
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

  #ended(status, lost) {
    this.#stream = null;
    this.attached = false;
    if (!this.wanted) return;
    this.#failed(new CallError(status, lost));
  }

  #failed(error) {
    const { handlers } = this;
    if (error.lost || this.connection.state !== 'open') return; // goes on with the connection
    const again = (seconds) => {
      this.#timer = setTimeout(() => this.#run(), seconds * 1000);
    };
    switch (error.code) {
      case Code.NOT_FOUND:
        if (this.#id) {
          this.#id = '';
          again(0);
        } else {
          handlers.problem(error.message, 'error');
        }
        break;
      case Code.ABORTED:
        this.wanted = false;
        handlers.problem('Another window has taken this session over. Move the camera to take it back.', 'error');
        break;
      case Code.INVALID_ARGUMENT:
        handlers.problem(error.message, 'error');
        if (this.#goBack()) again(0);
        break;
      case Code.RESOURCE_EXHAUSTED:
        if (!/try again/i.test(error.message) && this.#changed && this.#goBack()) {
          handlers.problem(error.message, 'error');
          again(0);
          break;
        }
        handlers.problem(`The daemon is full: ${error.message}. Trying again.`, 'error');
        again(RETRY_S);
        break;
      case Code.UNAVAILABLE:
        handlers.problem(`The daemon is stopping: ${error.message}. Save what you have; trying again.`, 'error');
        again(RETRY_S);
        break;
      case Code.OK:
        again(RETRY_S);
        break;
      default:
        handlers.problem(error.message, 'error');
        again(RETRY_S);
    }
  }
}
