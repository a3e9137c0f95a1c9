// The programs that show a channel of a picture, or of two compared: one for each way, which fetches and branches no
// more than that way needs. Values as in channels.js.

import { Kind } from './channels.js';
import { Compare } from './compare.js';

export const ToneMap = { CLIP: 0, FILMIC: 1, REINHARD: 2, FALSE_COLOUR: 3 };

export const vertexSource = `#version 300 es
uniform vec2 viewport, origin;  // of the film in the canvas, device pixels, y down
uniform float zoom;
layout(location = 0) in vec2 corner;  // film pixels
out vec2 film;
void main() {
  film = corner;
  vec2 at = (origin + corner * zoom) / viewport;
  gl_Position = vec4(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0);
}`;

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
uniform vec2 filmSize;
uniform sampler2DArray halfs, floats, referenceHalfs, referenceFloats;
uniform sampler2D jpeg, colours;
uniform int planes[6], referencePlanes[6], errors[8];  // layers of the arrays
uniform float encodedGain;
uniform float split;   // film pixels
uniform float gain;    // 2^exposure
uniform vec2 range;
uniform float floor_;  // the least mean that a relative error is told of
in vec2 film;
out vec4 colour;

float mean(vec3 v) { return (v.r + v.g + v.b) / 3.0; }
float luminance(vec3 v) { return dot(v, vec3(0.2126, 0.7152, 0.0722)); }
bool isOdd(vec3 v) { return any(isnan(v)) || any(isinf(v)); }

vec3 srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
// Mid grey stays at 0.18, 1 becomes 0.72, infinity 1; a short toe.
vec3 filmic(vec3 x) { return x * (2.2 * x + 0.1) / (x * (2.2 * x + 0.695) + 0.3); }

// row 0: of values in the range, 1: of differences around 0.
vec3 falseColour(float v, float row) {
  if (isnan(v)) return vec3(1.0, 0.0, 1.0);
  if (isinf(v)) return v > 0.0 ? vec3(0.13, 0.14, 0.15) : vec3(0.0);
  float t = LOGARITHMIC && row < 0.5 ? log(max(v, 1e-20) / range.x) / log(range.y / range.x)
                                     : (v - range.x) / (range.y - range.x);
  return texture(colours, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.25 + 0.5 * row)).rgb;
}
`;

// How a value of the channel becomes a colour: the body of shown(v).
function shownBody(kind, toneMap) {
  if (kind === Kind.NORMAL) return 'return clamp(0.5 * v + 0.5, 0.0, 1.0);';
  if (kind !== Kind.RGB) return 'return falseColour(v, 0.0);';
  const odd = 'if (isOdd(v)) return vec3(1.0, 0.0, 1.0);';
  if (toneMap === ToneMap.FALSE_COLOUR) return `${odd} return falseColour(luminance(v), 0.0);`;
  const mapped = { [ToneMap.FILMIC]: 'filmic(c)', [ToneMap.REINHARD]: 'c / (1.0 + luminance(c))' }[toneMap] ?? 'c';
  return `${odd} vec3 c = max(v * gain, 0.0); return srgb(${mapped});`;
}

// The expression of a picture's value at `at`. names: its uniforms and samplers; arrays: of each of its planes 'halfs',
// 'floats', or null where it has none.
function valueOf(kind, names, arrays, { smooth, encoded }) {
  if (encoded) {
    const c = smooth ? 'texture(jpeg, film / filmSize).rgb' : 'texelFetch(jpeg, at, 0).rgb';
    return `linear(${c}) * encodedGain`;
  }
  const fetch = (i) => (arrays[i] ? `texelFetch(${names[arrays[i]]}, ivec3(at, ${names.planes}[${i}]), 0).r` : '0.0');
  const three = (first) => `vec3(${[0, 1, 2].map((i) => fetch(first + i)).join(', ')})`;
  switch (kind) {
    case Kind.RGB:
    case Kind.NORMAL:
      if (smooth && [0, 1, 2].every((i) => arrays[i] === 'halfs')) {
        const sample = (i) => `texture(${names.halfs}, vec3(film / filmSize, ${names.planes}[${i}])).r`;
        return `vec3(${[0, 1, 2].map(sample).join(', ')})`;
      }
      return three(0);
    case Kind.STANDARD_ERROR:
      return `sqrt(mean(${three(0)}))`;
    case Kind.RELATIVE_ERROR:
      return `sqrt(mean(${three(0)})) / max(mean(${three(3)}), floor_)`;
    case Kind.RATIO:
      return `ratio(${fetch(0)}, ${fetch(1)})`;
    default:
      return fetch(0);
  }
}

const OWN = { halfs: 'halfs', floats: 'floats', planes: 'planes' };
const REFERENCE = { halfs: 'referenceHalfs', floats: 'referenceFloats', planes: 'referencePlanes' };

// The colour, of the values a and b.
function resultOf(rgb, compare, errors) {
  const difference = rgb ? 'sqrt(mean((a - b) * (a - b)))' : 'abs(a - b)';
  switch (compare) {
    case Compare.REFERENCE:
      return 'shown(b)';
    case Compare.SPLIT:
      return 'film.x < split ? shown(a) : shown(b)';
    case Compare.RELATIVE:
      return `falseColour(${difference} / ${rgb ? 'max(mean(b), floor_)' : 'max(abs(b), 1e-6)'}, 0.0)`;
    case Compare.ERRORS:
      if (rgb) {
        const fetch = (array, i) => {
          const names = i < 4 ? OWN : REFERENCE;
          return array ? `texelFetch(${names[array]}, ivec3(at, errors[${i}]), 0).r` : '0.0';
        };
        const all = errors.map(fetch);
        return `standardErrors(a, b, vec4(${all.slice(0, 4).join(', ')}), vec4(${all.slice(4).join(', ')}), at)`;
      }
      return `falseColour(${difference}, 0.0)`;
    case Compare.ABSOLUTE:
      return `falseColour(${difference}, 0.0)`;
    default:
      return 'shown(a)';
  }
}

// way: { kind, encoded, smooth, compare, nested, toneMap, logarithmic, own, reference, errors }; the last three are
// names of arrays, as valueOf() takes them.
export function fragmentSource(way) {
  const { kind, encoded, compare, nested, toneMap, logarithmic, own, reference, errors } = way;
  const rgb = kind === Kind.RGB || kind === Kind.NORMAL;
  const type = rgb ? 'vec3' : 'float';
  return `${COMMON.replace('LOGARITHMIC', String(!!logarithmic))}
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
float ratio(float a, float b) { return b > 0.0 ? a / b : 0.0; }
// As in compare.js; chequered where it is not defined. Variances and samples of the two.
vec3 standardErrors(vec3 a, vec3 b, vec4 errorsA, vec4 errorsB, ivec2 at) {
  float difference = luminance(a - b), errorA = luminance(sqrt(errorsA.rgb)), errorB = luminance(sqrt(errorsB.rgb));
  float variance = ${
    nested
      ? 'sign(errorsB.a - errorsA.a) * (errorA * errorA - errorB * errorB)'
      : 'errorA * errorA + errorB * errorB'
  };
  bool still = difference == 0.0 && errorA == 0.0 && errorB == 0.0;
  if (!(errorsA.a > 0.0 && errorsB.a > 0.0 && (still || ${nested ? 'variance > 0.0' : 'true'}))) {
    return vec3(0.26 + 0.1 * float((at.x + at.y) & 1));
  }
  return falseColour(still ? 0.0 : variance > 0.0 ? difference / sqrt(variance) : sign(difference) * 1e9, 1.0);
}
vec3 shown(${type} v) { ${shownBody(kind, toneMap)} }
void main() {
  ivec2 at = clamp(ivec2(floor(film)), ivec2(0), ivec2(filmSize) - 1);
  ${compare === Compare.REFERENCE ? '' : `${type} a = ${valueOf(kind, OWN, own, way)};`}
  ${compare === Compare.NONE ? '' : `${type} b = ${valueOf(kind, REFERENCE, reference, { ...way, encoded: false })};`}
  colour = vec4(${resultOf(rgb, compare, errors)}, 1.0);
}`;
}
