// Values of pictures at one pixel [y, x] of a grid (height, width), colour by colour.

import { fromFloat16 } from './picture.js';

function pick(values, [y, x], [height, width], { rows, columns, colours, first = 0 }) {
  const at = first + (Math.min(rows - 1, Math.floor(y * rows / height)) * columns + Math.min(columns - 1, Math.floor(x * columns / width))) * colours;
  return values.slice(at, at + colours);
}

export const valuesAt = ({ height, width, colours, values }, place, size) =>
  Array.from(pick(values, place, size, { rows: height, columns: width, colours }));

// Of each of a frame's parts.
export const partsAt = ({ shape: [count, rows, columns, colours], data, scale }, place, size) =>
  Array.from({ length: count }, (_, i) =>
    [...fromFloat16(pick(data, place, size, { rows, columns, colours, first: i * rows * columns * colours }), scale)]);
