// Values in false colour, and the colour bar that goes with them.

const STEPS = 255;
const TICKS = 2;

// Smaller values count as zero.
export const FLOOR = 1e-12;

function colourOf(stops, share) {
  const position = share * (stops.length - 1), below = Math.min(Math.floor(position), stops.length - 2);
  return stops[below].map((v, c) => v + (position - below) * (stops[below + 1][c] - v));
}

const tableOf = stops => Array.from({ length: STEPS + 1 }, (_, i) => colourOf(stops, i / STEPS).map(Math.round));

export const gradient = stops => `linear-gradient(to right, ${stops.map(c => `rgb(${c.map(Math.round)})`).join(', ')})`;

// Draws values (height, width) in a range { low, high, isLog } by a colour map, which has a colour for values that are not
// finite, and on a logarithmic scale for those of zero and less.
// isSigned: values count by their magnitudes, negative ones in colours of their own.
export function drawFalseColour(canvas, values, [height, width], { low, high, isLog }, map, { isSigned = false } = {}) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext('2d', { willReadFrequently: true }), image = pen.createImageData(width, height), { data } = image;
  const colours = tableOf(map.stops), negative = tableOf(map.negative);
  const first = isLog ? Math.log10(low) : low, breadth = (isLog ? Math.log10(high) : high) - first || 1;
  for (let i = 0, j = 0; i < values.length; i++, j += 4) {
    const value = isSigned ? Math.abs(values[i]) : values[i], at = isLog ? Math.log10(value) : value;
    const isThere = Number.isFinite(at) && !(isLog && value <= FLOOR);
    const table = isSigned && values[i] < -FLOOR ? negative : colours;
    const colour = isThere ? table[Math.round(STEPS * Math.min(1, Math.max(0, (at - first) / breadth)))] : map.none;
    data[j] = colour[0]; data[j + 1] = colour[1]; data[j + 2] = colour[2]; data[j + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
}

// A number of three digits.
export const numberText = value => {
  const size = Math.abs(value);
  return size !== 0 && (size < 0.001 || size >= 1e5) ? value.toExponential(1) : String(+value.toPrecision(3));
};

// Values at even distances along a range.
export function ticksOf({ low, high, isLog }, count = TICKS) {
  return Array.from({ length: count + 1 }, (_, i) => isLog ? low * (high / low) ** (i / count) : low + (high - low) * i / count);
}

// The colour bar of a figure, with texts of its ticks.
export function drawBar(figure, stops, texts) {
  figure.querySelector('.bar').style.background = gradient(stops);
  figure.querySelector('.scale').replaceChildren(...texts.map(textContent => Object.assign(document.createElement('span'), { textContent })));
}

export const drawBarOf = (figure, range, map, unit = '') =>
  drawBar(figure, map.stops, ticksOf(range).map((value, i, all) => numberText(value) + (unit && i === all.length - 1 ? ` ${unit}` : '')));

// Paints over the marked pixels of a picture, and tells whether there are any.
export function markPixels(canvas, marks, colour) {
  if (!marks.some(Boolean)) return false;
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  const image = pen.getImageData(0, 0, canvas.width, canvas.height);
  marks.forEach((mark, i) => mark && image.data.set([...colour, 255], 4 * i));
  pen.putImageData(image, 0, 0);
  return true;
}

// The values that one in a hundred is beyond, at either end, of those that are finite; on a logarithmic scale of those above 0.
export function usualRange(values, isLog) {
  const there = values.filter(v => Number.isFinite(v) && (!isLog || v > FLOOR)).toSorted();
  if (!there.length) return { low: isLog ? 0.1 : 0, high: 1 };
  const at = share => there[Math.round(share * (there.length - 1))];
  return { low: isLog ? at(0.01) : Math.min(0, at(0.01)), high: at(0.99) };
}
