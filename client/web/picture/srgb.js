// The transfer curve of sRGB (IEC 61966-2-1); shaders.js has it for the screen.

export const toSrgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
export const toLinear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);

// Of a linear value, which is clipped to [0, 1].
export const toSrgbByte = (v) => Math.round(255 * toSrgb(Math.min(1, Math.max(0, v))));
