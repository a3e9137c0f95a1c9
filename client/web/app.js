// The page: joins connection, scene, camera, pictures and panels, and keeps the state that they share.

import { announce, banner, say } from './messages.js';
import { Camera } from './camera/camera.js';
import { CameraPanel } from './panels/camera_panel.js';
import { listenToCamera } from './camera/camera_input.js';
import { channelById } from './picture/channels.js';
import { ComparePanel } from './panels/compare_panel.js';
import { Connection } from './protocol/connection.js';
import { ConvergencePlot } from './panels/convergence_plot.js';
import { button, coarse, find, make, short } from './dom.js';
import { Inspector } from './panels/inspector.js';
import { Link, LinkPanel } from './panels/link_panel.js';
import { Gaze } from './gaze.js';
import { listenToKeys } from './keys.js';
import { OpenPanel } from './panels/open_panel.js';
import { drawOverlay } from './picture/overlay.js';
import { Compare, compareNames } from './picture/compare.js';
import { noisiestPixel } from './picture/noisiest.js';
import { newLook, PicturePanel } from './panels/picture_panel.js';
import { RenderPanel } from './panels/render_panel.js';
import { savePicture } from './picture/save.js';
import { ScenePanel } from './panels/scene_panel.js';
import { SessionsPanel } from './panels/sessions_panel.js';
import { Scenes } from './protocol/scenes.js';
import { MOST_SESSIONS, newOwn, ownToText, readFields } from './session_settings.js';
import { statusLine, usedBudget } from './panels/status_line.js';
import { exposeForTests } from './test_access.js';
import { BoxTool, HandTool, SplitTool } from './tools.js';
import { address, keepToken, readState, takeToken, withinRange, writeState } from './url_state.js';
import { Viewport } from './viewport.js';

const MOST_PIXELS = 1280 * 720; // of a film that follows the window
const RESIZE_MS = 250;
const HISTOGRAM_MS = 700;
const DEPTH_MS = 8000;
const INSPECT_MS = 350;
// Colours of the sessions' lines in the plot.
const COLOURS = ['#f0b860', '#86d29a', '#d58bd9', '#ff8a70', '#5fd3d6', '#c9d05a', '#b6a0ff', '#e6e6e6'];
const SIGHT = 24; // CSS pixels from the stage's edge to a pixel that keys chose

// Width and height of a size that does not follow the window.
function fixedSize(size) {
  return /^(\d+)x(\d+)$/.exec(size)?.slice(1).map(Number);
}

const TOOL_HINTS = {
  region: 'Draw the box to render, or place it by arrows, size it by shift and arrows, and press enter.',
  zoom: 'Draw the box to zoom to, or place it by arrows, size it by shift and arrows, and press enter.',
  hand: 'Drags and arrow keys move the enlarged picture until escape or the button ends that.',
};

// A number with the digits that a link has of it.
const inLink = (value) => Number(value.toPrecision(9));

class App {
  #resizeTimer = 0;
  #measured = 0;
  #measureTimer = 0;
  #clipped = 0;
  #hoverTimer = 0;
  #wentHome = false; // the scene's own camera was tried since the last picture
  #hint = null; // the message that tells how the tool is used
  #wantedOf = new WeakMap(); // what was wanted, by the settings that it came to
  #cameraOf = new WeakMap(); // the camera as it was, by its message; of this scene

  constructor() {
    this.look = newLook();
    this.gaze = new Gaze(this);
    this.camera = new Camera();
    this.counters = { views: 0, whole: 0, previews: 0, previewTiles: 0, filmTiles: 0, gazes: 0 };
    this.viewports = [];
    this.leader = null; // alone has previews, which all show: the first viewport when the camera last moved
    this.wanted = {
      seed: 0,
      max_segments: 0,
      preview_rate: 20,
      preview_budget_ms: 0,
      preview_upscaling: 0,
      foveation: 0,
      region: null,
      size: 'window',
    };
    this.budget = { samples: 1024, time_s: 0, error: 0 };
    this.link = new Link(
      () => this.#linkChanged(),
      () => this.viewports.every(({ picture }) => picture.whole),
    );
    // Of all pictures: { zoom, centre }, pixels of the screen for one of the film and the point in the middle, in parts
    // of the film's sides; null: all of it fits.
    this.frame = null;
    this.paused = false;
    this.tool = null;
    this.splitTool = new SplitTool(this);
    this.info = {};
    this.stopReason = ''; // why there are no pictures for now
    this.say = say;
    this.drawOverlay = (viewport) => drawOverlay(this, viewport);
    this.connection = new Connection(
      takeToken(),
      (...told) => this.#connected(...told),
      this.link,
    );
    this.scenes = new Scenes(this.connection);
    Object.assign(this, readState()); // state, and ignored: what the address says that means nothing
  }

  get main() {
    return this.viewports[0];
  }
  get active() {
    return this.main;
  }

  async start() {
    find('loading').remove();
    find('app').hidden = false;
    addEventListener('hashchange', () => this.#followLink());
    const connecting = this.connection.start(); // answers later than what follows here
    try {
      this.leader = this.#open(newOwn(0, 0));
    } catch (error) {
      banner(
        error.message === 'WebGL2'
          ? 'This browser has no WebGL 2, which draws the picture. Enable graphics acceleration or use another browser.'
          : error.message,
      );
      this.connection.stop();
      return;
    }
    await connecting;
  }

  async #connected(state, sentence, more) {
    this.stopReason = '';
    find('connection').dataset.state = state;
    find('connection').textContent = {
      connecting: 'connecting',
      open: location.host,
      lost: 'reconnecting',
      refused: 'refused',
    }[state];
    if (state !== 'open') {
      if (this.connection.tokenRefused) this.#askForToken();
      else banner(sentence, more);
      this.#status();
      return;
    }
    banner('');
    try {
      this.info = await this.connection.call('get_server_info');
    } catch (error) {
      if (!error.lost) banner(error.message);
      return;
    }
    find('connection').title = `heliographd ${this.info.version}, ${this.info.threads} threads, ${this.info.isa}`;
    if (this.info.draining) banner('The daemon is stopping: it takes no new sessions.');
    if (!this.panels) this.#build();
    if (this.scenes.current) {
      say('Connected again.', 'good');
      if (!this.paused && !document.hidden) for (const viewport of this.viewports) viewport.session.run();
    } else {
      this.#openFromState();
    }
  }

  #askForToken() {
    const { token } = this.connection;
    const input = make('input', { id: 'token', type: 'password', autocomplete: 'off', 'aria-label': 'Token' });
    const connect = (event) => {
      event.preventDefault();
      this.connection.token = input.value.trim();
      keepToken(this.connection.token);
      this.connection.start();
    };
    banner(
      token ? "The token is not one of the daemon's." : 'The daemon wants a token.',
      make(
        'form',
        { id: 'token-form', class: 'row', on: { submit: connect } },
        input,
        button('token-connect', 'Connect', null, { type: 'submit' }),
      ),
    );
    input.focus();
  }

  #build() {
    const { codec } = this.connection,
      { state } = this;
    const defaults = {
      mode: codec.enum('Mode').MODE_COMBINED,
      integrator: codec.enum('Integrator').INTEGRATOR_PATH,
    };
    const { mode = defaults.mode, integrator = defaults.integrator } = state;
    const owns = state.sessions ?? [newOwn(mode, integrator)];
    for (const own of owns) this.#settle(own, defaults);
    Object.assign(this.main.own, owns[0]);
    for (const name of Object.keys(this.wanted)) if (state[name] !== undefined) this.wanted[name] = state[name];
    for (const name of ['samples', 'time_s', 'error']) if (state[name] !== undefined) this.budget[name] = state[name];
    const shown = { channel: 'channel', exposure: 'exposure', tone: 'toneMap', filter: 'filter', split: 'split' };
    for (const [name, of] of Object.entries(shown)) if (state[name] !== undefined) this.look[of] = state[name];
    if (state.zoom) this.frame = { zoom: state.zoom, centre: state.centre ?? [0.5, 0.5] };
    const [width, height] = fixedSize(this.wanted.size) ?? [];
    const problem = width !== undefined && this.#sizeProblem(width, height);
    if (problem) {
      this.ignored.push(`size=${this.wanted.size} (${problem})`);
      this.wanted.size = 'window';
    }
    if (state.range) Object.assign(this.look, { range: state.range, autoRange: false });
    if (state.linear) this.look.logarithmic = false;
    this.panels = {
      picture: new PicturePanel(this),
      render: new RenderPanel(this, this.info),
      sessions: new SessionsPanel(this, this.info),
      plot: new ConvergencePlot(this),
      compare: new ComparePanel(this),
      scene: new ScenePanel(this),
      camera: new CameraPanel(this),
      link: new LinkPanel(this),
      open: new OpenPanel(this),
    };
    this.inspector = new Inspector(this);
    this.sceneName = make('span', { id: 'scene-name' });
    const { picture, render, sessions, plot, compare, scene, camera, link, open } = this.panels;
    find('panel').append(
      make(
        'div',
        { class: 'brand' },
        make('b', { text: 'Heliograph' }),
        this.sceneName,
        button('help-open', '?', () => find('help').showModal(), { 'aria-label': 'All keys', title: 'All keys (?)' }),
      ),
      ...[picture, render, sessions, plot, compare, camera, scene, open, link].map((panel) => panel.element),
    );
    listenToKeys(this);
    find('pause').addEventListener('click', () => this.pause(!this.paused));
    find('panel-toggle').addEventListener('click', () => this.togglePanel());
    document.addEventListener('visibilitychange', () => this.#visible());
    addEventListener('pagehide', () => this.viewports.forEach((viewport) => viewport.session.close()));
    addEventListener('pageshow', (event) => event.persisted && this.#visible());
    this.#showPause();
    this.#showSessions();
    exposeForTests(this);
  }

  async #openFromState() {
    const { state } = this;
    this.panels.open.place(true);
    if (this.ignored.length) say(`The page ignores of the link: ${this.ignored.join('; ')}.`, 'error');
    this.#showLink();
    if (!state.scene && !state.id) return;
    try {
      await this.openScene(async () => {
        const answer = await this.#openLinked(state);
        if (state.edits?.length) await this.#editFromLink(state.edits);
        return answer;
      }, state.camera?.join(','));
      if (state.compare) {
        this.setCompare(compareNames.indexOf(state.compare));
        say('The link compares with a pinned picture, which no link has: pin one (P).', 'info');
      }
      this.addSessions(state.sessions?.slice(1) ?? [], false);
    } catch (error) {
      say(error.message, 'error');
      find('open-note').textContent = error.message;
    }
  }

  // With both, the path is where the scene that the daemon holds came from.
  async #openLinked({ scene, id, environment = '' }) {
    if (!id) return this.scenes.openPath(scene, environment);
    try {
      return await this.scenes.openId(id, scene);
    } catch (error) {
      if (!scene || error.lost) throw error;
      return this.scenes.openPath(scene, environment);
    }
  }

  // Edits that the daemon refuses are named, and the scene is shown without them.
  async #editFromLink(edits) {
    try {
      await this.scenes.setEdits(edits);
    } catch (error) {
      if (error.lost) throw error;
      this.#ignore(`edits (${error.message})`);
    }
  }

  // Replaces what the daemon has not of a session's settings.
  #settle(own, defaults) {
    for (const name of ['mode', 'integrator']) {
      const known = this.info[`${name}s`] ?? [];
      if (!known.length || known.includes(own[name])) continue;
      this.ignored.push(`${name}=${own[name]} (the daemon has ${known.join(', ')})`);
      own[name] = known.includes(defaults[name]) ? defaults[name] : known[0];
    }
    try {
      readFields(this.connection.codec, own.more);
    } catch (error) {
      this.ignored.push(error.message);
      own.more = '';
    }
  }

  // Names a part of the link that the page cannot follow.
  #ignore(part) {
    this.ignored.push(part);
    say(`The page ignores of the link: ${part}.`, 'error');
    this.#showLink();
  }

  #showLink() {
    const { compare } = this.look;
    const waits = compare !== Compare.NONE && !this.main.picture.reference;
    const parts = waits ? [`Pin a picture as the reference to compare with (${compareNames[compare]})`] : [];
    if (this.ignored.length) parts.push(`Ignored of the link: ${this.ignored.join('; ')}`);
    find('link-text').textContent = find('link-text').title = parts.join(' · ');
  }

  // load: makes the scene that scenes.js then has. camera: as text; absent: the scene's own.
  async openScene(load, camera = '') {
    const before = this.scenes.current;
    const answer = await load();
    for (const text of answer.warnings.slice(0, 3)) say(text, 'info');
    const { current } = this.scenes;
    this.#cameraOf = new WeakMap();
    this.camera.start(this.scenes.loaded);
    if (camera) this.camera.fromText(camera);
    if (before) {
      this.wanted.region = null;
      this.ignored = [];
    }
    this.unpin();
    const name = this.scenes.source.path?.split('/').pop() ?? this.scenes.source.main ?? current.name;
    this.sceneName.textContent = name;
    this.sceneName.title = this.scenes.source.path ?? name;
    document.title = `${name} · Heliograph`;
    this.panels.open.place(false);
    this.panels.scene.opened(answer.notices);
    this.panels.camera.opened();
    this.panels.picture.refresh();
    for (const viewport of this.viewports) this.#startSession(viewport, before !== null);
    this.main.overlay.focus({ preventScroll: true });
    this.saveState();
    announce(`${name} is open.`);
  }

  #startSession(viewport, runs) {
    const { session } = viewport;
    this.gaze.refresh(...this.#size());
    viewport.told.clear();
    session.settings = this.#settings(viewport);
    session.budget = this.#budget();
    session.format = viewport.format();
    session.exposure = this.look.exposure;
    if (runs && session.attached) {
      session.switchScene();
      this.moved(performance.now());
      return;
    }
    session.view = this.cameraMessage();
    viewport.meter.sent(1, performance.now());
    this.counters.views++;
    if (!this.paused && !document.hidden) session.run();
  }

  // Why the daemon takes no film of this size; '': it does.
  #sizeProblem(width, height) {
    const { max_film_side: side, max_film_pixels: pixels } = this.info.limits ?? {};
    if (width < 1 || height < 1) return 'A picture has a pixel a side at least.';
    if (side && Math.max(width, height) > side) return `The daemon takes ${side} pixels a side at most.`;
    if (pixels && width * height > Number(pixels)) {
      return `The daemon takes ${Number(pixels).toLocaleString('en')} pixels at most.`;
    }
    return '';
  }

  #size() {
    const { size } = this.wanted,
      fixed = fixedSize(size);
    if (fixed) return fixed;
    const { clientWidth, clientHeight } = this.main.stage,
      { max_film_pixels: pixels = 0 } = this.info.limits ?? {};
    const most = Math.min(MOST_PIXELS, Number(pixels) || Infinity);
    const wanted = { half: 0.5, screen: devicePixelRatio }[size] ?? 1; // times CSS pixels
    const scale = Math.min(wanted, Math.sqrt(most / Math.max(1, clientWidth * clientHeight)));
    return [clientWidth, clientHeight].map((side) => Math.max(16, Math.round(side * scale)));
  }

  #settings(viewport) {
    const { size, region, ...rest } = this.wanted;
    const [width, height] = this.#size();
    const box =
      region && region[2] <= width && region[3] <= height
        ? { region: { x0: region[0], y0: region[1], x1: region[2], y1: region[3] } }
        : {};
    const { layer, more, ...own } = viewport.own;
    const settings = { ...rest, ...own, ...readFields(this.connection.codec, more), width, height, ...box };
    settings.preview_upscaling = Boolean(rest.preview_upscaling);
    if (viewport !== this.leader) settings.preview_rate = 0;
    this.#wantedOf.set(settings, { wanted: { ...this.wanted }, own: { ...viewport.own } });
    return settings;
  }

  #budget() {
    return { ...this.budget, bytes_per_second: this.link.limit / this.viewports.length };
  }

  setSettings(changes) {
    Object.assign(this.wanted, changes);
    this.#sendSettings();
    this.panels.render.refresh();
    this.saveState();
  }

  #lead() {
    this.leader = this.main;
    this.#sendSettings();
  }

  #sendSettings() {
    this.gaze.refresh(...this.#size()); // before the film that is to have it
    for (const viewport of this.viewports) viewport.session.setSettings(this.#settings(viewport));
  }

  // Settings of one session. Where there are several, all begin anew, so that their times are equal.
  setOwn(viewport, changes) {
    Object.assign(viewport.own, changes);
    viewport.trouble = '';
    viewport.session.setFormat(viewport.format());
    this.#sessionsChanged();
    if (this.viewports.length > 1) this.#restart();
  }

  #restart() {
    for (const { session } of this.viewports) session.restart();
  }

  // Chooses the number of columns that makes the pictures of several sessions largest.
  #layOut() {
    const { clientWidth, clientHeight } = find('tiles'),
      [width, height] = fixedSize(this.wanted.size) ?? [16, 9];
    const zoom = (columns) =>
      Math.min(clientWidth / columns / width, clientHeight / Math.ceil(this.viewports.length / columns) / height);
    const [columns] = this.viewports.map((viewport, i) => i + 1).sort((a, b) => zoom(b) - zoom(a));
    find('tiles').style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
  }

  // A session with its tile, after the others.
  #open(own) {
    const viewport = new Viewport(this, own);
    find('tiles').append(viewport.stage);
    this.viewports.push(viewport);
    viewport.colour = COLOURS.find((colour) => !this.viewports.some((each) => each.colour === colour));
    this.gaze.listen(viewport);
    listenToCamera(this, viewport);
    viewport.listeners.add((what) => this.#heard(viewport, what));
    return viewport;
  }

  // Answers the sessions that were added: as many as there is room for. anew: those that were there begin anew.
  addSessions(owns, anew = true) {
    const room = MOST_SESSIONS - this.viewports.length;
    if (owns.length > room) say(`The page shows ${MOST_SESSIONS} sessions at most.`, 'info');
    if (this.tool.use) this.tool.leave();
    const added = [];
    try {
      for (const own of owns.slice(0, room)) added.push(this.#open({ ...own }));
    } catch (error) {
      say(`The browser has no room for another picture: ${error.message}`, 'error');
    }
    if (!added.length) return added;
    this.#sessionsChanged(`${this.viewports.length} sessions.`);
    if (anew) this.#restart();
    for (const viewport of added) {
      viewport.session.fallback = false;
      this.#startSession(viewport, false);
    }
    return added;
  }

  closeSession(viewport) {
    if (this.viewports.length < 2) return;
    this.viewports.splice(this.viewports.indexOf(viewport), 1);
    viewport.close();
    for (const { session, trouble } of this.viewports) if (trouble) session.tryNow();
    this.#sessionsChanged(`Closed: ${viewport.name}.`);
    this.main.overlay.focus({ preventScroll: true });
  }

  makeMain(viewport) {
    if (viewport === this.main) return;
    this.viewports.sort((a, b) => (b === viewport) - (a === viewport));
    find('tiles').prepend(viewport.stage);
    this.#sessionsChanged(`${viewport.name} is the first.`);
    this.main.overlay.focus({ preventScroll: true });
  }

  // Brings everything that tells of the sessions up to date. sentence: for screen readers.
  #sessionsChanged(sentence = '') {
    this.#layOut();
    this.inspector.hover(this.main, NaN, NaN);
    this.#showSessions();
    this.#sendSettings();
    this.setBudget({}); // they share the link
    this.stopped(this.main, this.main.stopReason);
    this.panels.compare.refresh();
    this.panels.picture.refresh();
    this.panels.picture.measure();
    this.#status();
    if (sentence) announce(sentence);
  }

  #showSessions() {
    this.viewports.forEach((viewport, i) => viewport.tile.refresh(i, this.viewports.length > 1, viewport.colour));
    this.panels.sessions.refresh();
  }

  // Shows what a session tells a person. kind: as messages.js has it.
  problem(viewport, sentence, kind) {
    if (kind === 'error') viewport.trouble = sentence;
    say(this.viewports.length > 1 ? `${viewport.name}: ${sentence}` : sentence, kind);
    viewport.tile.tell();
  }

  setSize(size) {
    const problem = fixedSize(size) && this.#sizeProblem(...fixedSize(size));
    if (problem) {
      say(problem, 'error');
      this.panels.render.refresh();
      return;
    }
    this.setSettings({ size, region: null });
  }

  setBudget(changes) {
    for (const [name, value] of Object.entries(changes)) this.budget[name] = withinRange(name, value);
    for (const viewport of this.viewports) viewport.session.setBudget(this.#budget());
    this.panels.render.refresh();
    this.panels.plot.refresh();
    this.saveState();
  }

  // The daemon refused settings: those before are in force again.
  refused(viewport, settings, budget) {
    const { mode } = settings,
      before = this.#wantedOf.get(settings);
    Object.assign(viewport.own, before?.own ?? { mode });
    this.#showSessions();
    if (viewport !== this.main) return;
    Object.assign(this.wanted, before?.wanted);
    this.gaze.refresh(...this.#size());
    const { samples = 0, time_s = 0, error = 0 } = budget;
    this.budget = { samples, time_s, error };
    this.panels.render.refresh();
    this.panels.plot.refresh();
    this.saveState();
  }

  setChannel(id) {
    this.look.channel = id;
    const channel = channelById(id);
    this.look.logarithmic = !!channel.log;
    if (channel.range) Object.assign(this.look, { range: [...channel.range], autoRange: false });
    else this.look.autoRange = true;
    for (const viewport of this.viewports) viewport.refreshFormat();
    this.panels.picture.refresh();
    this.panels.picture.measure();
    this.saveState();
  }

  setExposure(stops) {
    this.look.exposure = Math.min(64, Math.max(-64, Math.round(stops * 10) / 10));
    this.panels.picture.refresh();
    this.inspector.refresh();
    for (const { session } of this.viewports) session.exposure = this.look.exposure;
    this.saveState();
  }

  // The camera has changed, by an event of this time.
  moved(time) {
    this.counters.views++;
    if (this.leader !== this.main) this.#lead();
    for (const viewport of this.viewports) {
      if (viewport === this.main || !this.wanted.preview_rate) viewport.sendView(time);
      else viewport.follow();
    }
    this.inspector.refresh();
    this.panels.camera.refresh();
    this.saveState();
  }

  // CameraView of the camera as it is now.
  cameraMessage() {
    const message = this.camera.message();
    this.#cameraOf.set(message, this.camera.save());
    return message;
  }

  // The daemon refused a view. good: the newest one that gave a picture; null: none is known, and the scene's own
  // camera is tried.
  viewRefused(viewport, good) {
    if (viewport !== this.main) return; // the first is refused it, too
    const saved = good && this.#cameraOf.get(good);
    if (saved) this.camera.restore(saved);
    else if (this.#wentHome) return; // nothing is left to be tried
    else this.camera.reset();
    this.#wentHome = !saved;
    this.moved(performance.now());
  }

  // sentence: why there are no pictures for now; '': there are again.
  stopped(viewport, sentence) {
    const known = viewport.stopReason === sentence;
    viewport.stopReason = viewport.trouble = sentence;
    if (viewport !== this.main) {
      if (!known && sentence) this.problem(viewport, sentence, 'error');
      return;
    }
    if (sentence === this.stopReason) return;
    this.stopReason = sentence;
    if (this.connection.state === 'open') {
      find('connection').dataset.state = sentence ? 'stopped' : 'open';
      const again = button('try-again', 'Try again', () => this.viewports.forEach(({ session }) => session.tryNow()));
      if (sentence) banner(`${sentence.replace(/\.$/, '')}. The page tries again from time to time.`, again);
      else banner('');
    }
    this.#status();
  }

  resetCamera() {
    this.camera.reset();
    this.moved(performance.now());
  }

  async edit(key, edit) {
    try {
      if (key === null) await this.scenes.setEdits([]);
      else await this.scenes.edit(key, edit);
      for (const { session } of this.viewports) session.switchScene();
      this.saveState();
    } catch (error) {
      say(error.message, 'error');
    }
  }

  redraw() {
    for (const viewport of this.viewports) viewport.invalidate();
  }

  // All pictures show the same part of themselves.
  setFrame(frame) {
    this.frame = frame && {
      zoom: inLink(frame.zoom),
      centre: frame.centre.map((v) => inLink(Math.min(Math.max(v, 0), 1))),
    };
    for (const viewport of this.viewports) viewport.place();
    this.saveState();
  }

  zoom(factor) {
    this.active.zoomBy(factor, this.active.stage.clientWidth / 2, this.active.stage.clientHeight / 2);
  }

  // The comparison that a viewport really shows.
  comparing(viewport = this.active) {
    return viewport?.picture.comparable ? this.look.compare : Compare.NONE;
  }

  pin() {
    const { picture, progress } = this.main;
    if (!picture.film || !picture.whole) {
      say('There is no whole picture to pin yet.', 'info');
      return;
    }
    for (const viewport of this.viewports) viewport.picture.pin();
    const error = progress?.error?.known ? short(progress.error.rmse, 3) : 'unknown';
    this.pinnedAs = `${progress?.samples_per_pixel ?? 0} samples, error ${error}`;
    this.panels.plot.pin();
    this.setCompare(this.look.compare === Compare.NONE ? Compare.SPLIT : this.look.compare);
    say(`Pinned. Drag the line to wipe${coarse() ? '' : ', hold X to flip'}.`, 'info');
  }

  unpin() {
    for (const viewport of this.viewports) viewport.picture.unpin();
    this.setCompare(Compare.NONE);
    this.panels.plot.unpin();
  }

  setCompare(way) {
    this.look.compare = way;
    this.panels.compare.refresh();
    this.panels.picture.refresh();
    this.panels.picture.measure();
    this.#showLink();
    this.saveState();
  }

  // X is held: the pinned picture instead of the present one.
  flip(on) {
    if (!this.main.picture.reference || on === (this.keptCompare !== undefined)) return;
    if (on) this.keptCompare = this.look.compare;
    this.setCompare(on ? Compare.REFERENCE : this.keptCompare);
    if (!on) this.keptCompare = undefined;
  }

  moveSplit(by) {
    this.look.split = Number(Math.min(Math.max(this.look.split + by, 0), 1).toFixed(4));
    this.panels.compare.split.value = this.look.split;
    this.redraw();
    this.saveState();
  }

  pause(on) {
    this.paused = on;
    for (const { session } of this.viewports) {
      if (on) session.rest();
      else session.run();
    }
    this.#showPause();
    announce(on ? 'Paused.' : 'Rendering.');
  }

  #showPause() {
    const path = this.paused ? 'M5 3.500v9l7-4.500z' : 'M5 3.500v9M11 3.500v9';
    find('pause').querySelector('path').setAttribute('d', path);
    find('pause').setAttribute('aria-label', this.paused ? 'Go on' : 'Pause');
    this.#status();
  }

  // A move of the camera ends a pause. True: the session starts, with the newest view.
  resume(viewport) {
    if (!this.scenes.current) return true;
    viewport.session.view = this.cameraMessage();
    this.paused = false;
    viewport.session.run();
    this.#showPause();
    return true;
  }

  #visible() {
    if (!this.scenes.current) return;
    for (const { session } of this.viewports) {
      if (document.hidden) session.rest();
      else if (!this.paused) session.run();
    }
  }

  togglePanel() {
    const open = find('app').dataset.panel === 'closed';
    find('app').dataset.panel = open ? 'open' : 'closed';
    find('panel-toggle').setAttribute('aria-expanded', String(open));
    this.panels.plot.refresh();
  }

  // What drags do instead of moving the camera: 'region', 'zoom' or 'hand'; again, or null: no more.
  useTool(use) {
    this.#hint?.remove();
    this.#hint = null;
    const before = this.tool?.use ?? null;
    const next = use === before ? null : use;
    if (before && use) this.tool.leave();
    this.tool = next === 'hand' ? new HandTool(this) : next ? new BoxTool(this, next) : this.splitTool;
    for (const { overlay } of this.viewports) {
      if (next) overlay.dataset.tool = next;
      else delete overlay.dataset.tool;
    }
    for (const name of Object.keys(TOOL_HINTS)) {
      find(`tool-${name}`).setAttribute('aria-pressed', String(next === name));
    }
    if (!next) return;
    this.main.overlay.focus({ preventScroll: true });
    this.#hint = say(TOOL_HINTS[next], 'info');
  }

  // chosen: by a key or a tap, so that no pointer shows where it is.
  hover(viewport, x, y, chosen = false) {
    if (!this.inspector) return;
    this.inspector.hover(viewport, x, y, chosen);
    if (chosen) this.#keepInSight();
    if (chosen && this.inspector.at) this.gaze.lookAt(...this.inspected);
    for (const each of this.viewports) this.drawOverlay(each);
    if (chosen) announce(this.inspector.sentence());
    clearTimeout(this.#hoverTimer);
    this.#hoverTimer = setTimeout(() => this.#inspects(viewport), INSPECT_MS);
  }

  // The gaze is pinned, or no longer.
  gazePinned() {
    this.panels.render.refresh();
    for (const viewport of this.viewports) this.drawOverlay(viewport);
    this.#status();
  }

  // Moves the enlarged picture so far that the inspected pixel is on the stage.
  #keepInSight() {
    const { viewport, at } = this.inspector;
    if (!at || !this.frame) return;
    const { clientWidth, clientHeight } = viewport.stage;
    const [x, y] = viewport.stageAt(at[0] + 0.5, at[1] + 0.5);
    const out = (v, side) => Math.min(v - SIGHT, 0) + Math.max(v + SIGHT - side, 0);
    const [dx, dy] = [out(x, clientWidth), out(y, clientHeight)];
    if (dx || dy) viewport.shift(-dx, -dy);
  }

  // The pointer rests on a picture: modes that carry pictures over tell of it from now on.
  #inspects(viewport) {
    if (!viewport.carries || !this.inspector.at || viewport.extra.has('history')) return;
    if (viewport.moving) {
      this.#hoverTimer = setTimeout(() => this.#inspects(viewport), INSPECT_MS);
      return;
    }
    viewport.extra.add('history');
    viewport.refreshFormat();
  }

  // Distance to what the pixel shows; undefined: it was not to be had.
  async depthAt(viewport, x, y) {
    const read = () => {
      const { picture } = viewport,
        depth = picture.film?.planes.get('Z');
      return depth?.stamp === picture.revision && picture.freshAt(x, y) && !picture.under
        ? picture.film.at('Z', x, y)
        : undefined;
    };
    const view = viewport.session.viewId;
    if (read() === undefined) {
      viewport.extra.add('depth');
      viewport.refreshFormat();
      const end = performance.now() + DEPTH_MS;
      while (read() === undefined && performance.now() < end) await new Promise((resume) => setTimeout(resume, 30));
    }
    return viewport.session.viewId - view <= 1 ? read() : undefined;
  }

  async #pick(viewport, x, y) {
    const [px, py] = viewport.filmAt(x, y).map(Math.floor),
      [u, v] = viewport.uvAt(x, y);
    if (!(Math.abs(u) <= 1 && Math.abs(v) <= 1)) return null;
    const before = this.camera.save();
    viewport.mark = { x, y, time: performance.now() };
    viewport.invalidate();
    const depth = await this.depthAt(viewport, px, py);
    if (!Number.isFinite(depth)) {
      say(depth === undefined ? 'The depth there is not known yet.' : 'There is nothing at this point.', 'info');
      return null;
    }
    const now = this.camera.save();
    if (JSON.stringify(now.position) !== JSON.stringify(before.position)) return null;
    return this.camera.pointAt(u, v, viewport.aspect, depth);
  }

  async pickPivot(viewport, x, y) {
    const point = await this.#pick(viewport, x, y);
    if (!point) return;
    this.camera.pivot = point;
    say('The camera orbits around this point now.', 'info');
    this.saveState();
  }

  // The inspected pixel, or the middle of the picture: a viewport and a point of its stage.
  get inspected() {
    const { viewport, at } = this.inspector;
    if (at) return [viewport, ...viewport.stageAt(at[0] + 0.5, at[1] + 0.5)];
    return [this.main, this.main.stage.clientWidth / 2, this.main.stage.clientHeight / 2];
  }

  // Focuses the lens on what the inspected pixel shows.
  async pickFocus() {
    const point = await this.#pick(...this.inspected);
    if (!point) return;
    this.camera.focus(point);
    this.moved(performance.now());
    say(
      `Focused at ${short(this.camera.optics.focus_distance)}, lens radius ${short(this.camera.optics.lens_radius)}.`,
      'info',
    );
  }

  lens(factor) {
    const radius = this.camera.optics.lens_radius || 0;
    if (!radius && factor < 1) return;
    this.camera.set({ lens_radius: radius * factor || this.camera.distance / 400 });
    this.moved(performance.now());
  }

  pinhole() {
    this.camera.set({ lens_radius: 0 });
    this.moved(performance.now());
  }

  onResize(viewport) {
    clearTimeout(this.#resizeTimer);
    this.#resizeTimer = setTimeout(() => {
      if (!this.scenes.current || /\d/.test(this.wanted.size)) return;
      this.#sendSettings();
    }, RESIZE_MS);
    if (viewport !== this.main || !this.panels) return;
    this.#layOut();
    this.panels.plot.refresh();
  }

  #linkChanged() {
    for (const viewport of this.viewports) {
      viewport.refreshFormat();
      viewport.session.setBudget(this.#budget());
    }
    this.panels?.link.refresh();
  }

  async save(kind) {
    const name = (this.sceneName.textContent || 'picture').replace(/\.\w+$/, '');
    const saving = say(`Saving ${name}.${kind} …`, 'busy');
    try {
      const saved = await savePicture(this.active.picture, kind, name);
      say(saved ? `Saved ${name}.${kind}.` : 'There is no whole picture to save yet.', saved ? 'good' : 'info');
    } catch (error) {
      say(`${name}.${kind} could not be saved: ${error.message}`, 'error');
    }
    saving.remove();
  }

  // Inspects the noisiest pixel of what the stage shows.
  inspectNoisiest() {
    const viewport = this.active,
      { picture, stage } = viewport;
    const corners = [viewport.filmAt(0, 0).map(Math.floor), viewport.filmAt(stage.clientWidth, stage.clientHeight)];
    const sides = [picture.width, picture.height];
    const box = corners.flatMap((corner) => corner.map((v, i) => Math.min(Math.max(Math.ceil(v), 0), sides[i])));
    const pixel = picture.film && noisiestPixel(picture.film, box, (x, y) => picture.isKnown(x, y));
    if (!pixel) {
      say('No standard error is known of what is shown.', 'info');
      return;
    }
    this.hover(viewport, ...viewport.stageAt(pixel[0] + 0.5, pixel[1] + 0.5), true);
    announce(`Noisiest: ${this.inspector.sentence()}`);
  }

  async copyLink() {
    const link = address({ ...this.#address(), size: this.#size().join('x') });
    const without = this.connection.token ? ', without the token: whoever opens it needs one' : '';
    try {
      await navigator.clipboard.writeText(new URL(link, location.href).href);
      say(`The link is on the clipboard${without}.`, 'good');
    } catch {
      history.replaceState(null, '', link);
      say(`The link is in the address bar${without}.`, 'info');
    }
  }

  async copyPixel() {
    const text = this.inspector.text();
    if (!text) return;
    try {
      await navigator.clipboard.writeText(text);
      say('The pixel is on the clipboard.', 'good');
    } catch {
      say('The browser does not let the page write to the clipboard.', 'error');
    }
  }

  #address() {
    const { look, wanted, budget, scenes } = this,
      { path, environment } = scenes.source;
    const several = this.viewports.length > 1 || ownToText(this.main.own).split(',').length > 2;
    return {
      scene: path,
      id: path ? '' : scenes.loaded.scene_id,
      environment,
      edits: scenes.editEntries(),
      camera: this.camera.isHome ? '' : this.camera.toText(),
      size: wanted.size === 'window' ? '' : wanted.size,
      ...(several
        ? { sessions: this.viewports.map((viewport) => ownToText(viewport.own)).join(';') }
        : { mode: this.main.own.mode, integrator: this.main.own.integrator }),
      seed: wanted.seed || '',
      max_segments: wanted.max_segments || '',
      preview_rate: wanted.preview_rate,
      preview_budget_ms: wanted.preview_budget_ms || '',
      preview_upscaling: wanted.preview_upscaling || '',
      foveation: wanted.foveation || '',
      region: wanted.region?.join(','),
      samples: budget.samples,
      time_s: budget.time_s || '',
      error: budget.error || '',
      channel: look.channel,
      exposure: look.exposure || '',
      tone: look.toneMap || '',
      range: look.autoRange ? '' : (this.panels.picture.keptRange ?? look.range).map(inLink).join(','),
      linear: look.logarithmic ? '' : 1,
      filter: look.filter === 'auto' ? '' : look.filter,
      zoom: this.frame?.zoom,
      centre: this.frame?.centre.join(','),
      compare: compareNames[this.keptCompare ?? look.compare],
      split: look.split === 0.5 ? '' : look.split,
    };
  }

  saveState() {
    if (this.scenes.current) writeState(() => this.#address());
  }

  // Somebody changed the fragment, or went back: a link to another state is followed by loading the page again.
  #followLink() {
    takeToken();
    location.reload();
  }

  #heard(viewport, what) {
    if (!this.panels) return;
    const main = viewport === this.main;
    if (what === 'begin') {
      this.#wentHome = false;
      if (!viewport.continued) viewport.points = [];
      this.scenes.sweep();
      if (main) this.panels.render.refresh();
      if (main && this.comparing() === Compare.ERRORS) this.panels.picture.refresh(); // its scale tells how
    } else if (what === 'progress' || what === 'end') {
      this.panels.plot.add(viewport);
      if (main) this.#status();
      if (what === 'end') this.scenes.sweep();
      if (what === 'end' && main) announce(statusLine(this));
    } else if (what === 'tile' || what === 'whole') {
      if (main) this.#measure();
      if (this.inspector.at) this.#clip();
    }
    if (what !== 'tile' && what !== 'drawn') for (const { tile } of main ? this.viewports : [viewport]) tile.tell();
  }

  // Inspector: at most ten times a second.
  #clip() {
    this.#clipped ||= setTimeout(() => {
      this.#clipped = 0;
      this.inspector.refresh();
    }, 100);
  }

  // Histogram and range: while the camera rests, and not often.
  #measure() {
    const wait = this.#measured + HISTOGRAM_MS - performance.now();
    this.#measureTimer ||= setTimeout(
      () => {
        this.#measureTimer = 0;
        if (this.main.moving || this.main.picture.under) return;
        this.#measured = performance.now();
        this.panels.picture.measure();
      },
      Math.max(wait, 60),
    );
  }

  #status() {
    find('status-text').textContent = find('status-text').title = statusLine(this);
    const used = usedBudget(this);
    find('progress').setAttribute('aria-valuenow', String(Math.round(100 * used)));
    find('progress').firstChild.style.width = `${100 * used}%`;
  }
}

new App().start();
