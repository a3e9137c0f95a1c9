// The state that a link reproduces, in the fragment of the address: scene, edits, camera, settings, how it is shown.

// Lowest and highest, as types.proto has them; 0: the daemon's default, or no limit.
export const RANGES = {
  mode: [0, 1000],
  integrator: [0, 1000],
  seed: [0, Number.MAX_SAFE_INTEGER],
  max_segments: [0, 65535],
  preview_rate: [0, 120],
  preview_budget_ms: [0, 1000],
  samples: [0, 2 ** 30],
  time_s: [0, 1e9],
  error: [0, 1e12],
  exposure: [-64, 64],
  tone: [0, 3],
};
const FRACTIONS = new Set(['preview_rate', 'preview_budget_ms', 'time_s', 'error', 'exposure']);
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

export function readState() {
  const parameters = new URLSearchParams(location.hash.slice(1));
  const state = Object.fromEntries(parameters);
  for (const name of Object.keys(RANGES)) {
    const value = Number(state[name]);
    if (state[name] === undefined || !Number.isFinite(value)) delete state[name];
    else state[name] = withinRange(name, value);
  }
  try {
    state.edits = state.edits ? JSON.parse(state.edits) : [];
  } catch {
    state.edits = [];
  }
  const region = state.region?.split(',').map(Number) ?? [];
  state.region = region.length === 4 && region.every(Number.isInteger) ? region : null;
  return state;
}

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
  return `#${parameters.toString().replaceAll('%2F', '/').replaceAll('%2C', ',')}`;
}
