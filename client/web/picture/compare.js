// How a picture is compared with the pinned one.
export const Compare = { NONE: 0, REFERENCE: 1, SPLIT: 2, ABSOLUTE: 3, RELATIVE: 4, ERRORS: 5 };

// The difference of two pixels in standard errors, by luminance. A pixel's channels come from the same paths, so their
// errors go together: standard errors are added, not variances. Each argument has three numbers; shaders.js forms the
// same.
export function standardErrors(a, b, varianceA, varianceB) {
  let difference = 0,
    error = 0;
  [0.2126, 0.7152, 0.0722].forEach((weight, c) => {
    difference += weight * (a[c] - b[c]);
    error += weight * Math.sqrt(varianceA[c] + varianceB[c]);
  });
  return error > 0 ? difference / error : difference === 0 ? 0 : Math.sign(difference) * 1e9;
}
