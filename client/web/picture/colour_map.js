// Two colour maps, made here in OKLab (Ottosson 2020, "A perceptual color space for image processing",
// bottosson.github.io/posts/oklab): their lightness is linear, so that equal steps look equal, also in grey.

import { toSrgbByte } from './srgb.js';

function oklabToSrgb(L, a, b) {
  const l = (L + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (L - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (L - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  return linear.map(toSrgbByte);
}

// From dark blue by magenta and orange to pale yellow.
function sequential(t) {
  const hue = ((-80 + 185 * t) * Math.PI) / 180;
  const chroma = 0.03 + 0.15 * Math.sin(Math.PI * Math.min(1, 0.12 + 0.88 * t)) ** 0.8;
  return oklabToSrgb(0.16 + 0.8 * t, chroma * Math.cos(hue), chroma * Math.sin(hue));
}

// Dark grey at the centre; blue below, orange above.
function diverging(t) {
  const d = Math.abs(2 * t - 1),
    hue = ((t < 0.5 ? 250 : 60) * Math.PI) / 180,
    chroma = 0.15 * Math.min(1, 1.4 * d);
  return oklabToSrgb(0.22 + 0.62 * d, chroma * Math.cos(hue), chroma * Math.sin(hue));
}

// 256 RGBA texels; row 0 sequential, row 1 diverging.
export const colourMap = new Uint8Array(2 * 256 * 4);
[sequential, diverging].forEach((map, row) => {
  for (let i = 0; i < 256; i++) colourMap.set([...map(i / 255), 255], (row * 256 + i) * 4);
});
