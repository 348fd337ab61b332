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

// Those of `count` equal parts of a side whose middles lie from `first` on up to, but without, `last`.
const partsWithin = (first, last, side, count) => Array.from({ length: count }, (_, i) => i).filter(i => {
  const middle = (i + 0.5) * side / count;
  return middle >= first && middle < last;
});

// The mean over a region [top, left, bottom, right] of that grid, colour by colour; of the pixel in its middle where the picture is too coarse.
export function meanIn(picture, [top, left, bottom, right], size) {
  const { height, width, colours, values } = picture;
  const rows = partsWithin(top, bottom, size[0], height), columns = partsWithin(left, right, size[1], width), count = rows.length * columns.length;
  if (!count) return valuesAt(picture, [Math.floor((top + bottom) / 2), Math.floor((left + right) / 2)], size);
  const sums = Array(colours).fill(0);
  for (const y of rows) for (const x of columns) for (let c = 0; c < colours; c++) sums[c] += values[(y * width + x) * colours + c];
  return sums.map(sum => sum / count);
}
