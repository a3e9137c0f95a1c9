// The state that a link reproduces, in the fragment of the address: scene, edits, camera, settings, how it is shown.

const NUMBERS = [
  'mode',
  'integrator',
  'seed',
  'max_segments',
  'preview_rate',
  'preview_budget_ms',
  'samples',
  'time_s',
  'error',
  'exposure',
  'tone',
];

// The token goes from the address at once, and stays for reloads of this tab.
export function takeToken() {
  const parameters = new URLSearchParams(location.hash.slice(1));
  const given = parameters.get('token');
  if (given !== null) {
    parameters.delete('token');
    sessionStorage.setItem('heliograph-token', given);
    const rest = parameters.toString();
    history.replaceState(null, '', rest ? `#${rest}` : location.pathname);
  }
  return given ?? sessionStorage.getItem('heliograph-token') ?? '';
}

export function readState() {
  const parameters = new URLSearchParams(location.hash.slice(1));
  const state = Object.fromEntries(parameters);
  for (const name of NUMBERS) {
    const value = Number(state[name]);
    if (state[name] === undefined || !Number.isFinite(value)) delete state[name];
    else state[name] = value;
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
