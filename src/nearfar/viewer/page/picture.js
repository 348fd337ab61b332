// From the numbers of direct, near- and far-range light to what is seen.

const halves = new Float32Array(65536);
for (let i = 0; i < 65536; i++) {
  const sign = i & 0x8000 ? -1 : 1, exponent = i >> 10 & 31, part = i & 1023;
  halves[i] = exponent === 31 ? (part ? 0 : sign * 65504)
    : sign * (exponent === 0 ? part * 2 ** -24 : (1 + part / 1024) * 2 ** (exponent - 15));
}

const STEPS = 65535;
const tone = new Uint8ClampedArray(STEPS + 1);
let toneOf = 0;

// sRGB, and a gamma on top of it; 1 is as it was measured.
function fillTone(gamma) {
  if (toneOf === gamma) return;
  for (let i = 0; i <= STEPS; i++) {
    // By the square root of the light: the dark has as many steps as the eye needs.
    const v = (i / STEPS) ** 2;
    const shown = v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
    tone[i] = Math.round(255 * shown ** (1 / gamma));
  }
  toneOf = gamma;
}

// Numbers come as float16 times a scale.
export function unhalve(bits, scale) {
  const values = new Float32Array(bits.length);
  for (let i = 0; i < bits.length; i++) values[i] = halves[bits[i]] / scale;
  return values;
}

// The sum of parts (3, y, x, colours), each with its gain, in photo units.
export function sum({ shape, data, scale }, gains) {
  const count = data.length / 3, found = new Float32Array(count);
  const [d, n, f] = gains.map(gain => gain / scale);
  for (let i = 0; i < count; i++)
    found[i] = d * halves[data[i]] + n * halves[data[i + count]] + f * halves[data[i + 2 * count]];
  return { height: shape[1], width: shape[2], colours: shape[3], values: found };
}

export function onePart({ shape, data, scale }, which, gain) {
  const count = data.length / 3, found = new Float32Array(count), at = which * count;
  for (let i = 0; i < count; i++) found[i] = gain / scale * halves[data[at + i]];
  return { height: shape[1], width: shape[2], colours: shape[3], values: found };
}

export function show(canvas, { height, width, colours, values }, { exposure, gamma }) {
  fillTone(gamma);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext('2d', { willReadFrequently: true }), image = pen.createImageData(width, height), out = image.data;
  const scale = 2 ** exposure;
  const level = v => tone[v <= 0 ? 0 : Math.min(STEPS, STEPS * Math.sqrt(v * scale) + 0.5 | 0)];
  if (colours === 1)
    for (let i = 0, j = 0; i < values.length; i++, j += 4) {
      out[j] = out[j + 1] = out[j + 2] = level(values[i]); out[j + 3] = 255;
    }
  else
    for (let i = 0, j = 0; i < values.length; i += 3, j += 4) {
      out[j] = level(values[i]); out[j + 1] = level(values[i + 1]); out[j + 2] = level(values[i + 2]);
      out[j + 3] = 255;
    }
  pen.putImageData(image, 0, 0);
}

export function showLevels(canvas, { height, width, levels, colour }) {
  const values = new Float32Array(3 * height * width), each = levels.length === values.length ? 1 : 3;
  for (let i = 0; i < values.length; i++) values[i] = levels[each === 1 ? i : i / 3 | 0] / 65535 * colour[i % 3];
  show(canvas, { height, width, colours: 3, values }, { exposure: 0, gamma: 1 });
}

// Stops at which all but one value in two hundred are below white.
export function exposureFor({ values }) {
  const step = Math.max(1, Math.floor(values.length / 20000)), some = [];
  for (let i = 0; i < values.length; i += step) some.push(values[i]);
  some.sort((a, b) => a - b);
  const bright = some[Math.floor(0.995 * (some.length - 1))];
  return bright > 0 ? Math.max(-6, Math.min(12, Math.round(10 * Math.log2(0.95 / bright)) / 10)) : 0;
}
