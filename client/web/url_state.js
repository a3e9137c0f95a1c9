// The state that a link reproduces, in the fragment of the address: scene, edits, camera, settings, how the picture is
// shown and compared.

import { isCamera } from './camera/camera.js';
import { channels } from './picture/channels.js';
import { compareNames } from './picture/compare.js';
import { MOST_SESSIONS, ownFromText } from './session_settings.js';

export const ZOOMS = [0.05, 256]; // pixels of the screen for one of the film

// Lowest and highest, as types.proto has them; 0: the daemon's default, or no limit.
export const RANGES = {
  mode: [0, 1000],
  integrator: [0, 1000],
  seed: [0, Number.MAX_SAFE_INTEGER],
  max_segments: [0, 65535],
  preview_rate: [0, 120],
  preview_budget_ms: [0, 1000],
  preview_upscaling: [0, 1],
  foveation: [0, 3],
  samples: [0, 2 ** 30],
  time_s: [0, 1e9],
  error: [0, 1e12],
  exposure: [-64, 64],
  tone: [0, 3],
  zoom: ZOOMS,
  split: [0, 1],
};
const FRACTIONS = new Set(['preview_rate', 'preview_budget_ms', 'time_s', 'error', 'exposure', 'zoom', 'split']);
const LEAST_PREVIEW_MS = 5;

export function withinRange(name, value) {
  const [low, high] = RANGES[name];
  const within = Math.min(Math.max(value, low), high);
  if (name === 'preview_budget_ms' && within > 0) return Math.max(within, LEAST_PREVIEW_MS);
  return FRACTIONS.has(name) ? within : Math.round(within);
}

// The token goes from the address at once, and stays for reloads of this tab.
export function takeToken() {
  const parameters = new URLSearchParams(location.hash.slice(1));
  const given = parameters.get('token');
  if (given !== null) {
    parameters.delete('token');
    keepToken(given);
    const rest = parameters.toString();
    history.replaceState(null, '', rest ? `#${rest}` : location.pathname);
  }
  return given ?? sessionStorage.getItem('heliograph-token') ?? '';
}

export function keepToken(token) {
  sessionStorage.setItem('heliograph-token', token);
}

const numbers = (count) => (text) => {
  const list = text.split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  return list.length === count && list.every(Number.isFinite) ? list : undefined;
};
const oneOf = (names) => [(text) => (names.includes(text) ? text : undefined), names.join(', ')];
const where = (read, holds) => (text) => {
  const value = read(text);
  return value !== undefined && holds(value) ? value : undefined;
};

function readEdits(text) {
  try {
    const edits = JSON.parse(text);
    const whole = ([key, edit]) => typeof key === 'string' && edit !== null && typeof edit === 'object';
    return Array.isArray(edits) && edits.every((entry) => Array.isArray(entry) && whole(entry)) ? edits : undefined;
  } catch {
    return undefined;
  }
}

function readSessions(text) {
  const owns = text.split(';').map(ownFromText);
  return owns.length <= MOST_SESSIONS && owns.every(Boolean) ? owns : undefined;
}

function inRange(name) {
  const [low, high] = RANGES[name];
  const read = where(numbers(1), ([value]) => value >= low && value <= high);
  return [(text) => (read(text) ? withinRange(name, Number(text)) : undefined), `a number from ${low} to ${high}`];
}

const text = [(value) => value || undefined, 'a name'];
// Of each part of a link: what its text means (undefined: nothing), and what it may be, in words.
const PARTS = {
  scene: text,
  id: text,
  environment: text,
  edits: [readEdits, 'a JSON list of edits'],
  camera: [where(numbers(17), isCamera), '17 numbers, each in the range of its field of CameraView'],
  size: [
    (size) => (/^(window|screen|half|\d+x\d+)$/.test(size) ? size : undefined),
    'window, screen, half, or as 640x360',
  ],
  region: [
    where(numbers(4), ([x0, y0, x1, y1]) => [x0, y0, x1, y1].every(Number.isInteger) && x0 < x1 && y0 < y1),
    'x0,y0,x1,y1 in pixels',
  ],
  ...Object.fromEntries(Object.keys(RANGES).map((name) => [name, inRange(name)])),
  channel: oneOf(channels.map(({ id }) => id)),
  range: [where(numbers(2), ([low, high]) => low < high), 'two numbers, the lower one first'],
  linear: oneOf(['1']),
  filter: oneOf(['auto', 'nearest', 'linear']),
  centre: [where(numbers(2), (centre) => centre.every((v) => v >= 0 && v <= 1)), 'two numbers from 0 to 1'],
  compare: oneOf(compareNames.filter(Boolean)),
  sessions: [readSessions, `${MOST_SESSIONS} at most, apart by semicolons, each as mode,integrator,NAME=VALUE,...`],
};

// { state, ignored }: what the address says, and a sentence of each part that says nothing.
export function readState() {
  const state = {},
    ignored = [];
  for (const [name, given] of new URLSearchParams(location.hash.slice(1))) {
    const [read, allowed] = Object.hasOwn(PARTS, name) ? PARTS[name] : [];
    const value = read?.(given);
    if (value !== undefined) state[name] = value;
    else ignored.push(`${brief(name)}=${brief(given)} (${allowed ?? 'unknown'})`);
  }
  return { state, ignored };
}

const brief = (given) => (given.length > 24 ? `${given.slice(0, 24)}…` : given);

let timer = 0;

// Writes it when nothing has changed for a moment: browsers limit how often the address may change.
export function writeState(make) {
  clearTimeout(timer);
  timer = setTimeout(() => {
    history.replaceState(null, '', address(make()));
  }, 350);
}

export function address(state) {
  const parameters = new URLSearchParams();
  for (const [name, value] of Object.entries(state)) {
    if (value === undefined || value === null || value === '' || (Array.isArray(value) && !value.length)) continue;
    parameters.set(name, name === 'edits' ? JSON.stringify(value) : String(value));
  }
  return `#${parameters.toString().replace(/%(2F|2C|3B|3D)/g, decodeURIComponent)}`;
}
