// How a picture is compared with the pinned one.
export const Compare = { NONE: 0, REFERENCE: 1, SPLIT: 2, ABSOLUTE: 3, RELATIVE: 4, ERRORS: 5 };
