// Maps in false colour, spectra and profiles.

export const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function colourOf(scale, share) {
  const position = Math.min(1, Math.max(0, share)) * (scale.length - 1), below = Math.min(Math.floor(position), scale.length - 2);
  return scale[below].map((v, c) => v + (position - below) * (scale[below + 1][c] - v));
}

export const gradient = scale => `linear-gradient(to right, ${scale.map(c => `rgb(${c})`).join(', ')})`;

// Where a value is not finite.
const NONE = [128, 128, 128];

// Values (height, width) between low and high; grey where a value is not finite.
export function drawMap(canvas, values, [height, width], low, high, scale) {
  Object.assign(canvas, { width, height });
  const pen = canvas.getContext('2d', { willReadFrequently: true }), image = pen.createImageData(width, height);
  const table = Array.from({ length: 256 }, (_, i) => colourOf(scale, i / 255).map(Math.round)), { data } = image;
  for (let i = 0, j = 0; i < values.length; i++, j += 4) {
    const share = (values[i] - low) / (high - low || 1);
    const colour = Number.isFinite(values[i]) ? table[Math.round(255 * Math.min(1, Math.max(0, share)))] : NONE;
    data[j] = colour[0]; data[j + 1] = colour[1]; data[j + 2] = colour[2]; data[j + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
}

// Paints over the marked pixels of a map, and tells whether there are any.
export function markPixels(canvas, marks, colour) {
  if (!marks.some(Boolean)) return false;
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  const image = pen.getImageData(0, 0, canvas.width, canvas.height);
  marks.forEach((mark, i) => mark && image.data.set([...colour, 255], 4 * i));
  pen.putImageData(image, 0, 0);
  return true;
}

// Smaller values count as zero.
const FLOOR = 1e-12;

const TICKS = 2;

// Of negative values, from the dark end of the page's scale to red.
const NEGATIVE = [[38, 20, 72], [125, 28, 82], [205, 62, 78], [255, 165, 130]];

// Magnitudes on a log scale, as many decades below the largest as most of them take; grey at zero, negative values in red.
// Returns the logarithm of the largest, and the share of negative values in the sum of magnitudes.
export function drawLog(canvas, values, shape, scale) {
  const logarithms = new Float32Array(values.length);
  let high = Math.log10(FLOOR), sum = 0, below = 0;
  for (let i = 0; i < values.length; i++) {
    const v = Math.abs(values[i]);
    logarithms[i] = v > FLOOR ? Math.log10(v) : NaN;
    if (logarithms[i] > high) high = logarithms[i];
    if (v > 0) sum += v;
    if (values[i] < 0) below += v;
  }
  const decades = decadesOf(logarithms, high);
  drawMap(canvas, logarithms, shape, high - decades, high, scale);
  if (below > 0) redden(canvas, values, logarithms, high - decades, high);
  showBar(canvas, scale, Array.from({ length: TICKS + 1 }, (_, i) => tickText(10 ** (high - decades + i * decades / TICKS))));
  return { high, negative: sum > 0 ? below / sum : 0 };
}

const tickText = value => value < 0.01 ? value.toExponential(1) : value.toPrecision(2);

// Decades from one value in twenty of the smallest up to the largest, 1 to 5.
function decadesOf(logarithms, high) {
  const there = logarithms.filter(Number.isFinite).toSorted();
  return Math.min(5, Math.max(1, Math.ceil(high - (there[Math.floor(there.length / 20)] ?? high))));
}

function redden(canvas, values, logarithms, low, high) {
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  const image = pen.getImageData(0, 0, canvas.width, canvas.height);
  for (let i = 0; i < values.length; i++)
    if (values[i] < -FLOOR) image.data.set(colourOf(NEGATIVE, (logarithms[i] - low) / (high - low)).map(Math.round), 4 * i);
  pen.putImageData(image, 0, 0);
}

// The colour bar below a canvas, with texts at even distances.
function showBar(canvas, scale, texts) {
  const figure = canvas.closest('figure'), bar = figure.querySelector('.bar'), ticks = figure.querySelector('.scale');
  bar.style.background = gradient(scale);
  ticks.replaceChildren(...texts.map(text => Object.assign(document.createElement('span'), { textContent: text })));
}

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

// A spectrum in dB with DC in the middle, enlarged so that the frames of k_near and k_far and the dots
// of measured frequencies are fine.
export function drawSpectrum(canvas, values, [height, width], { measured, k_near: near, k_far: far }, scale) {
  const small = new OffscreenCanvas(width, height);
  let low = -10;
  for (let i = 0; i < values.length; i++) if (values[i] < low) low = values[i];
  low = Math.max(-80, low);
  drawMap(small, values, [height, width], low, 0, scale);
  showBar(canvas, scale, [`${low.toFixed(0)} dB`, '0 dB']);
  const large = Math.max(1, Math.ceil(360 / Math.max(height, width)));
  // On the page the plot is some 300 pixels wide, whatever the canvas has.
  const thick = Math.max(1, large * Math.max(height, width) / 400);
  Object.assign(canvas, { width: large * width, height: large * height });
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.imageSmoothingEnabled = false;
  pen.drawImage(small, 0, 0, canvas.width, canvas.height);
  const at = (k, side) => (Math.floor(side / 2) + 0.5 + k * side) * large;
  pen.fillStyle = '#ffffffa0';
  for (const [ky, kx] of measured)
    for (const sign of [1, -1]) {
      pen.beginPath();
      pen.arc(at(sign * kx, width), at(sign * ky, height), 1.4 * thick, 0, 7);
      pen.fill();
    }
  for (const [colour, broad, [ky, kx]] of [['#000', 4, near], [css('--near'), 2, near], ['#000', 4, far], ['#fff', 2, far]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = broad * thick;
    const x = at(-kx, width) - large / 2, y = at(-ky, height) - large / 2;
    pen.strokeRect(x, y, 2 * kx * width * large + large, 2 * ky * height * large + large);
  }
}
