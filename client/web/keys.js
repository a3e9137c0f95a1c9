// Keys of the whole page (those that move the camera are in camera_input.js), bookmarks, and the page that tells them.

import { announce, closeMessage, say } from './messages.js';
import { find, make, onLeave } from './dom.js';

const HELP = [
  ['Drag, arrow keys', 'Orbit'],
  ['Shift drag, right drag', 'Pan'],
  ['Wheel, pinch', 'Move to the cursor'],
  ['W A S D Q E', 'Fly; with shift faster'],
  ['Double click, O', 'Orbit around this point; around the inspected one'],
  ['F; comma, period', 'Focus the lens on the inspected point; close, open the lens'],
  ['R', 'Reset the camera'],
  ['1 … 9', 'Go to a bookmark; with shift: set it'],
  ['0, Shift 0', 'Fit; one to one'],
  ['Alt wheel, + −', 'Zoom into the picture; alt drag moves it'],
  ['[ ]', 'Exposure; backspace: none'],
  ['N, M', 'Next, previous channel'],
  ['T', 'Next tone map'],
  ['P, X, V', 'Pin; hold to flip; next comparison'],
  ['< >', 'Move the split; or drag it'],
  ['B, Z, H; escape', 'Draw the region, the box to zoom to; move the enlarged picture; end that, or close a message'],
  ['Enter, alt arrows', 'Inspect the middle; the pixel beside, with shift ten on'],
  ['G', 'Inspect the noisiest pixel of what is shown'],
  ['C', 'Copy the pixel'],
  ['L', 'With foveation: the gaze stays here; follows the pointer'],
  ['K', 'Compare modes: sessions side by side'],
  ['I, \\', 'Figures; side panel'],
  ['Space', 'Pause, go on'],
];

export function listenToKeys(app) {
  app.tool = app.splitTool;
  const dialog = find('help');
  dialog.append(
    make(
      'div',
      { class: 'head' },
      make('h1', { text: 'Keys' }),
      make('button', { id: 'help-close', type: 'button', text: 'Close', on: { click: () => dialog.close() } }),
    ),
    make('dl', {}, ...HELP.flatMap(([keys, text]) => [make('dt', { text: keys }), make('dd', { text })])),
  );
  const bookmarks = new Bookmarks(app);
  const step = (element, by) => {
    const { options } = element;
    element.selectedIndex = (element.selectedIndex + by + options.length) % options.length;
    element.dispatchEvent(new Event('change'));
    announce(options[element.selectedIndex].text);
  };
  const actions = {
    KeyF: () => app.pickFocus(),
    KeyR: () => app.resetCamera(),
    KeyP: () => app.pin(),
    KeyB: () => app.useTool('region'),
    KeyZ: () => app.useTool('zoom'),
    KeyH: () => app.useTool('hand'),
    KeyO: () => app.pickPivot(...app.inspected),
    KeyG: () => app.inspectNoisiest(),
    KeyC: () => app.copyPixel(),
    KeyL: () => app.gaze.pin(),
    KeyK: () => app.panels.sessions.show(),
    KeyI: () => app.panels.link.showHud(find('hud').hidden),
    Backslash: () => app.togglePanel(),
    Space: () => app.pause(!app.paused),
    BracketLeft: () => app.setExposure(app.look.exposure - 0.5),
    BracketRight: () => app.setExposure(app.look.exposure + 0.5),
    Backspace: () => app.setExposure(0),
    KeyN: () => step(find('channel'), 1),
    KeyM: () => step(find('channel'), -1),
    KeyT: () => step(find('tone-map'), 1),
    KeyV: () => app.main.picture.reference && step(find('compare'), 1),
    Equal: () => app.zoom(1.25),
    Minus: () => app.zoom(0.8),
    KeyX: () => app.flip(true),
    NumpadAdd: () => app.zoom(1.25),
    NumpadSubtract: () => app.zoom(0.8),
    Comma: (event) => (event.shiftKey ? app.moveSplit(-0.02) : app.lens(0.8)),
    Period: (event) => (event.shiftKey ? app.moveSplit(0.02) : app.lens(1.25)),
  };
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
    const { target } = event;
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) && target.type !== 'range' && target.type !== 'checkbox')
      return;
    if (event.code === 'Space' && /^(BUTTON|SUMMARY|INPUT)$/.test(target.tagName)) return;
    if (event.key === '?') {
      dialog.showModal();
      return;
    }
    if (event.key === 'Escape') {
      if (app.tool.use) app.tool.leave();
      else closeMessage();
      return;
    }
    if (!app.scenes.current) return;
    const digit = /^Digit(\d)$/.exec(event.code)?.[1];
    if (digit === '0') {
      if (event.shiftKey) app.active.showOneToOne();
      else app.setFrame(null);
    } else if (digit) {
      if (event.shiftKey) bookmarks.set(digit);
      else bookmarks.go(digit);
    } else if (actions[event.code]) {
      actions[event.code](event);
    } else {
      return;
    }
    event.preventDefault();
  });
  addEventListener('keyup', (event) => event.code === 'KeyX' && app.flip(false));
  onLeave(document.body, () => app.flip(false));
}

// Cameras by digit, kept in this browser for each scene.
class Bookmarks {
  constructor(app) {
    this.app = app;
  }

  get #key() {
    const { source, loaded } = this.app.scenes;
    return `heliograph-bookmarks:${source.path ?? loaded.scene_id}`;
  }

  #all() {
    try {
      return JSON.parse(localStorage.getItem(this.#key) ?? '{}');
    } catch {
      return {};
    }
  }

  set(digit) {
    try {
      localStorage.setItem(this.#key, JSON.stringify({ ...this.#all(), [digit]: this.app.camera.toText() }));
      say(`Bookmark ${digit} set.`, 'good');
    } catch (error) {
      say(`The browser keeps no bookmarks: ${error.message}`, 'error');
    }
  }

  go(digit) {
    const text = this.#all()[digit];
    if (!text || !this.app.camera.fromText(text)) {
      say(`There is no bookmark ${digit}. Shift and ${digit} sets it.`, 'info');
      return;
    }
    this.app.moved(performance.now());
    announce(`Bookmark ${digit}.`);
  }
}
