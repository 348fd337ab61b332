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

// Magnitudes on a log scale, down to a number of decades below the largest; grey at zero.
// Returns the logarithm of the largest.
export function drawLog(canvas, values, shape, scale, decades = 5) {
  const logarithms = new Float32Array(values.length);
  let high = Math.log10(FLOOR);
  for (let i = 0; i < values.length; i++) {
    const v = Math.abs(values[i]);
    logarithms[i] = v > FLOOR ? Math.log10(v) : NaN;
    if (logarithms[i] > high) high = logarithms[i];
  }
  drawMap(canvas, logarithms, shape, high - decades, high, scale);
  return high;
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
  for (const [name, [ky, kx]] of [['--near', near], ['--far', far]]) {
    pen.strokeStyle = css(name);
    pen.lineWidth = 2 * thick;
    const x = at(-kx, width) - large / 2, y = at(-ky, height) - large / 2;
    pen.strokeRect(x, y, 2 * kx * width * large + large, 2 * ky * height * large + large);
  }
}

// Lines over the same pixels on a log scale, each with a band of one standard deviation, which is the
// whole plot where the deviation is infinite.
export function drawProfile(canvas, lines, label) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth || 600, h = 170;
  Object.assign(canvas, { width: w * ratio, height: h * ratio });
  canvas.style.height = h + 'px';
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.scale(ratio, ratio);
  let high = Math.log10(FLOOR);
  for (const { values } of lines) for (const v of values) high = Math.max(high, Math.log10(Math.abs(v) + FLOOR));
  const top = Math.ceil(high), low = top - 6, left = 38, bottom = h - 20;
  const within = v => Math.min(top, Math.max(low, Math.log10(Math.max(v, FLOOR))));
  const y = v => bottom - (within(v) - low) / (top - low) * (bottom - 6);
  pen.font = '11px system-ui';
  pen.fillStyle = css('--soft');
  pen.strokeStyle = css('--line');
  for (let power = low; power <= top; power += 2) {
    pen.beginPath(); pen.moveTo(left, y(10 ** power)); pen.lineTo(w, y(10 ** power)); pen.stroke();
    pen.fillText('1e' + power, 0, y(10 ** power) + 4);
  }
  pen.fillText(label, left, h - 5);
  for (const { values, errors, colour } of lines) {
    const x = i => left + (i + 0.5) / values.length * (w - left);
    pen.fillStyle = pen.strokeStyle = css(colour);
    pen.globalAlpha = 0.25;
    pen.beginPath();
    for (let i = 0; i < values.length; i++) pen.lineTo(x(i), y(values[i] + errors[i]));
    for (let i = values.length - 1; i >= 0; i--) pen.lineTo(x(i), y(values[i] - errors[i]));
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (let i = 0; i < values.length; i++) pen.lineTo(x(i), y(values[i]));
    pen.stroke();
  }
}
