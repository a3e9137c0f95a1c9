// IEEE 754 half precision numbers.

// Every half as a float, by its bits.
export const halfToFloat = new Float32Array(65536);
for (let bits = 0; bits < 65536; bits++) {
  const sign = bits & 0x8000 ? -1 : 1,
    exponent = (bits >> 10) & 31,
    mantissa = bits & 1023;
  if (exponent === 0) halfToFloat[bits] = sign * mantissa * 2 ** -24;
  else if (exponent === 31) halfToFloat[bits] = mantissa ? NaN : sign * Infinity;
  else halfToFloat[bits] = sign * (1024 + mantissa) * 2 ** (exponent - 25);
}

const float = new Float32Array(1);
const word = new Uint32Array(float.buffer);

// Rounds to the nearest half, ties to even.
export function floatToHalf(value) {
  float[0] = value;
  const bits = word[0],
    sign = (bits >>> 16) & 0x8000,
    magnitude = bits & 0x7fffffff;
  if (magnitude > 0x7f800000) return sign | 0x7e00;
  if (magnitude >= 0x477ff000) return sign | 0x7c00;
  if (magnitude < 0x38800000) {
    const scaled = Math.abs(float[0]) * 2 ** 24,
      below = Math.floor(scaled),
      rest = scaled - below;
    return sign | (below + (rest > 0.5 || (rest === 0.5 && below & 1) ? 1 : 0));
  }
  return sign | ((magnitude - 0x38000000 + 0xfff + ((magnitude >>> 13) & 1)) >>> 13);
}
