// How a picture is compared with the pinned one.
export const Compare = { NONE: 0, REFERENCE: 1, SPLIT: 2, ABSOLUTE: 3, RELATIVE: 4, ERRORS: 5 };

// The same as links have them.
export const compareNames = ['', 'pinned', 'split', 'absolute', 'relative', 'errors'];

// How the samples of two pictures are related, which decides the variance of their difference.
export const Relation = {
  INDEPENDENT: 0, // nothing is known that they share: the variances add up
  SEED: 1, // the same random numbers in another picture: correlated, by an amount that is not known
  NESTED: 2, // the samples of one are the first ones of the other: var(b - a) = var(a) - var(b), a the one with fewer
};

const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

// The difference of two pixels in standard errors, by luminance. A pixel's channels come from the same paths, so their
// errors go together: its standard error is the luminance of theirs. a, b: three numbers; planesA, planesB: the numbers
// of planesForError. NaN: it is not defined (no samples; of nested ones no more, or a variance that did not fall). 0
// where neither differs nor varies, as of the background. shaders.js forms the same.
export function standardErrors(a, b, planesA, planesB, relation) {
  const [[squareA, samplesA], [squareB, samplesB]] = [planesA, planesB].map(([red, green, blue, samples]) => [
    luminance([red, green, blue].map(Math.sqrt)) ** 2,
    samples,
  ]);
  if (!(samplesA > 0 && samplesB > 0)) return NaN;
  const difference = luminance(a) - luminance(b);
  if (difference === 0 && squareA === 0 && squareB === 0) return 0;
  if (relation === Relation.NESTED) {
    const variance = Math.sign(samplesB - samplesA) * (squareA - squareB);
    return variance > 0 ? difference / Math.sqrt(variance) : NaN;
  }
  const error = Math.sqrt(squareA + squareB);
  return error > 0 ? difference / error : Math.sign(difference) * 1e9;
}
