// The twelve numbers of an object's transform: three rows of four, the last column the place. The only file that knows
// their order.

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

const at = (transform, row, column) => transform[4 * row + column];
const make = (element) => [0, 1, 2].flatMap((row) => [0, 1, 2, 3].map((column) => element(row, column)));

// As a message has it, where none is the identity.
export const transformOf = (numbers) => (numbers?.length === IDENTITY.length ? numbers : IDENTITY);

export const placeOf = (transform) => [0, 1, 2].map((row) => at(transform, row, 3));

// Turned by an angle (radians) about the vertical, scaled, and put at a place instead of its own.
export function turnedAndScaled(transform, angle, size, place) {
  const [c, s] = [Math.cos(angle) * size, Math.sin(angle) * size];
  const about = [
    [c, 0, s],
    [0, size, 0],
    [-s, 0, c],
  ];
  return make((row, column) =>
    column === 3
      ? place[row]
      : about[row].reduce((sum, factor, k) => sum + factor * at(transform, k, column), 0),
  );
}
