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
