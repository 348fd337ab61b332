// Rows of the transport as pictures, and spectra.

import { FLOOR, drawBar, drawBarOf, drawFalseColour, numberText } from './false-colour.js';

export const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Draws values that should not be negative, in colours of their own where they are; by magnitude, with a range of that.
// Returns the share of negative values in the sum of magnitudes.
export function drawSigned(canvas, values, shape, figures, name) {
  const map = figures.colourMap;
  const range = figures.range(name, true, isLog => rangeOf(values, isLog));
  drawFalseColour(canvas, values, shape, range, map, { isSigned: true });
  drawBarOf(canvas.closest('figure'), range, map);
  let sum = 0, below = 0;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    sum += Math.abs(value);
    if (value < 0) below -= value;
  }
  return sum > 0 ? below / sum : 0;
}

// From zero, or as many decades below the largest magnitude as most of them take.
function rangeOf(values, isLog) {
  let high = FLOOR;
  for (const value of values) if (Math.abs(value) > high) high = Math.abs(value);
  return { low: isLog ? high / 10 ** decadesOf(values, high) : 0, high };
}

// Decades from one value in twenty of the smallest up to the largest, 1 to 5.
function decadesOf(values, high) {
  const there = Float32Array.from(values.filter(v => Math.abs(v) > FLOOR), v => Math.log10(Math.abs(v))).toSorted();
  return Math.min(5, Math.max(1, Math.ceil(Math.log10(high) - (there[Math.floor(there.length / 20)] ?? Math.log10(high)))));
}

// The share of negative light, of the sum of magnitudes, in words.
export const negativeText = (share, { negative_name: name }) =>
  share >= 0.001 ? `; ${(100 * share).toFixed(share < 0.1 ? 1 : 0)} % of it negative, in ${name}` : '';

// The square of values around a position, NaN beyond the border.
export function crop(values, [height, width], [cy, cx], reach) {
  const side = 2 * reach + 1, cropped = new Float32Array(side * side).fill(NaN);
  for (let y = 0; y < side; y++)
    for (let x = 0; x < side; x++) {
      const py = Math.round(cy) + y - reach, px = Math.round(cx) + x - reach;
      if (py >= 0 && py < height && px >= 0 && px < width) cropped[y * side + x] = values[py * width + px];
    }
  return { values: cropped, shape: [side, side] };
}

const LOWEST_DECIBELS = -80, LEAST_RANGE = -10;

function lowestOf(values) {
  let low = LEAST_RANGE;
  for (const value of values) if (value < low) low = value;
  return Math.max(LOWEST_DECIBELS, low);
}

// A spectrum in dB with DC in the middle, enlarged so that the frames of k_near and k_far and the dots
// of measured frequencies are fine.
export function drawSpectrum(canvas, values, [height, width], { measured, k_near: near, k_far: far }, figures) {
  const small = new OffscreenCanvas(width, height), map = figures.colourMap;
  const range = figures.range('spectrum', false, () => ({ low: lowestOf(values), high: 0 }));
  drawFalseColour(small, values, [height, width], range, map);
  drawBar(canvas.closest('figure'), map.stops, [range.low, range.high].map(value => `${numberText(value)} dB`));
  const large = Math.max(1, Math.ceil(360 / Math.max(height, width)));
  // On the page the plot is some 300 pixels wide, whatever the canvas has.
  const thick = Math.max(1, large * Math.max(height, width) / 400);
  Object.assign(canvas, { width: large * width, height: large * height });
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.imageSmoothingEnabled = false;
  pen.drawImage(small, 0, 0, canvas.width, canvas.height);
  const at = (k, side) => (Math.floor(side / 2) + 0.5 + k * side) * large;
  for (const [ky, kx] of measured)
    for (const sign of [1, -1]) {
      pen.beginPath();
      pen.arc(at(sign * kx, width), at(sign * ky, height), 1.4 * thick, 0, 7);
      // White over black, as either vanishes on some colour of some map.
      pen.fillStyle = '#ffffffa0'; pen.fill();
      pen.strokeStyle = '#00000060'; pen.lineWidth = 0.6 * thick; pen.stroke();
    }
  for (const [colour, broad, [ky, kx]] of [['#000', 4, near], [css('--near'), 2, near], ['#000', 4, far], ['#fff', 2, far]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = broad * thick;
    const x = at(-kx, width) - large / 2, y = at(-ky, height) - large / 2;
    pen.strokeRect(x, y, 2 * kx * width * large + large, 2 * ky * height * large + large);
  }
}
