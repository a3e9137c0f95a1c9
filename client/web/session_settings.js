// The settings in which the sessions of a page differ, as the page keeps and shows them and as links have them:
// { mode, integrator, variant } by their numbers, layer (which picture of the session is shown, by id; '': the one that
// the picture panel says) and more: further fields of RenderSettings as text, as "roulette=throughput seed=7".

export const MOST_SESSIONS = 8;

const MODES = {
  MODE_COMBINED: 'Combined',
  MODE_REPROJECT: 'Reproject',
  MODE_ADAPTIVE: 'Adaptive',
  MODE_PT: 'Path tracing',
};
const INTEGRATORS = {
  INTEGRATOR_PATH: 'Path',
  INTEGRATOR_BDPT: 'Bidirectional',
  INTEGRATOR_PT_BDPT: 'Path or bidirectional',
  INTEGRATOR_LVC: 'Light vertex cache',
  INTEGRATOR_VCM: 'Vertex merging',
  INTEGRATOR_PHOTON: 'Photon mapping',
  INTEGRATOR_LIGHT: 'Light tracing',
};
const FOVEATIONS = {
  FOVEATION_DENSITY: 'Where the pointer is',
  FOVEATION_PAPER: 'As published',
};
export const LAYERS = [
  ['', 'As the others'],
  ['radiance', 'Film'],
  ['display', 'Filtered'],
  ['oidn', 'Open Image Denoise'],
];
const SHARED = [
  'width',
  'height',
  'region',
  'mode',
  'integrator',
  'variant',
  'preview_rate',
  'preview_budget_ms',
  'preview_upscaling',
  'foveation',
];
const FRACTIONS = [1, 2]; // types of a field, by their numbers in descriptor.proto: double, float

// The values of an enum that the daemon has: [[number, name], ...].
function offered(codec, name, words, known) {
  const numbers = codec.enum(name);
  return Object.entries(words)
    .filter(([key]) => key in numbers && (!known.length || known.includes(numbers[key])))
    .map(([key, text]) => [String(numbers[key]), text]);
}
export const offeredModes = (codec, known) => offered(codec, 'Mode', MODES, known);
export const offeredIntegrators = (codec, known) => offered(codec, 'Integrator', INTEGRATORS, known);

export const offeredFoveations = (codec) => [['0', 'Off'], ...offered(codec, 'Foveation', FOVEATIONS, [])];

export const newOwn = (mode, integrator) => ({ mode, integrator, variant: 0, layer: '', more: '' });

export function sessionName(codec, { mode, integrator, variant, layer, more }) {
  const { VARIANT_PAPER } = codec.enum('Variant');
  const way = codec.nameOf('Integrator', integrator);
  return [
    MODES[codec.nameOf('Mode', mode)] ?? `mode ${mode}`,
    way === 'INTEGRATOR_PATH' ? '' : (INTEGRATORS[way] ?? `integrator ${integrator}`),
    variant === VARIANT_PAPER ? 'as published' : '',
    layer && LAYERS.find(([id]) => id === layer)[1],
    more,
  ]
    .filter(Boolean)
    .join(' · ');
}

// The fields of RenderSettings that a text names. Throws an Error that names the part that it cannot read.
export function readFields(codec, text) {
  const settings = {};
  for (const part of text.split(/\s+/).filter(Boolean)) {
    const [path, given = ''] = part.split('=');
    const names = path.split('.');
    let type = codec.messages.get('heliograph.v1.RenderSettings'),
      into = settings;
    names.forEach((name, i) => {
      const field = type.fields.find((each) => each.name === name && !SHARED.includes(name));
      const inner = codec.messages.get(field?.of);
      if (!field || !inner === i < names.length - 1) {
        const allowed = type.fields.map((each) => each.name).filter((each) => !SHARED.includes(each));
        throw new Error(`${part}: no number NAME=VALUE; names: ${allowed.join(', ')}; parts: adaptive.min_samples`);
      }
      if (inner) [type, into] = [inner, (into[name] ??= {})];
      else into[name] = readValue(codec.enums[field.of], field, part, given);
    });
  }
  return settings;
}

function readValue(names, field, part, given) {
  const named = Object.keys(names ?? {}).find((name) => name.endsWith(`_${given.toUpperCase()}`));
  const value = names?.[named] ?? (given === '' ? NaN : Number(given));
  if (FRACTIONS.includes(field.type) ? Number.isFinite(value) : Number.isSafeInteger(value)) return value;
  const values = Object.keys(names ?? {}).map((name) => name.toLowerCase());
  throw new Error(`${part}: ${values.length ? `one of ${values.join(', ')}` : 'a number'} is needed`);
}

export function ownToText({ mode, integrator, variant, layer, more }) {
  const named = [variant && `variant=${variant}`, layer && `layer=${layer}`, ...more.split(' ')];
  return [mode, integrator, ...named.filter(Boolean)].join(',');
}

// undefined: it is none.
export function ownFromText(text) {
  const [mode, integrator, ...rest] = text.split(',');
  const own = newOwn(Number(mode || NaN), Number(integrator || NaN));
  const more = rest.filter((part) => {
    const [name, value] = part.split('=');
    if (name !== 'variant' && name !== 'layer') return true;
    own[name] = name === 'layer' ? value : Number(value);
    return false;
  });
  own.more = more.join(' ');
  const whole = [own.mode, own.integrator, own.variant].every((v) => Number.isInteger(v) && v >= 0);
  return whole && LAYERS.some(([id]) => id === own.layer) ? own : undefined;
}
