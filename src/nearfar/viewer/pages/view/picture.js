// Pictures { height, width, colours, values }: from the float16 parts of a frame to pixels of a canvas.

import { WHITE_LEVEL } from './colour.js';
import { CHANNELS } from './state.js';

// The value of each float16 by its 16 bits; infinities are the largest finite values, NaN is 0.
const FLOAT16_VALUES = Float32Array.from({ length: 65536 }, (_, bits) => {
  const sign = bits & 0x8000 ? -1 : 1, exponent = bits >> 10 & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? 0 : sign * 65504;
  return sign * (exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15));
});

const TONE_STEPS = 65535;
// The newest tone curve: sliders ask for the same one again and again.
const newestTone = { gamma: 0, bytes: new Uint8ClampedArray(TONE_STEPS + 1) };

// Bytes of the screen by the square root of linear light, so that dark light has as many steps as the
// eye can see: the sRGB curve, and a gamma on top of it.
function toneCurve(gamma) {
  const { bytes } = newestTone;
  if (newestTone.gamma === gamma) return bytes;
  for (let i = 0; i <= TONE_STEPS; i++) {
    const v = (i / TONE_STEPS) ** 2;
    const srgb = v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
    bytes[i] = Math.round(255 * srgb ** (1 / gamma));
  }
  newestTone.gamma = gamma;
  return bytes;
}

export function fromFloat16(bits, scale) {
  const values = new Float32Array(bits.length);
  for (let i = 0; i < bits.length; i++) values[i] = FLOAT16_VALUES[bits[i]] / scale;
  return values;
}

// A picture (y, x, colours) of a message, in photo units.
export const pictureOf = ({ shape: [height, width, colours], data }, scale) =>
  ({ height, width, colours, values: fromFloat16(data, scale) });

// The sum of a frame's parts (3, y, x, colours), each with its gain, in photo units.
export function sumOfParts({ shape, data, scale }, gains) {
  const count = data.length / 3, values = new Float32Array(count);
  const [direct, near, far] = gains.map(gain => gain / scale);
  for (let i = 0; i < count; i++)
    values[i] = direct * FLOAT16_VALUES[data[i]] + near * FLOAT16_VALUES[data[i + count]] + far * FLOAT16_VALUES[data[i + 2 * count]];
  return { height: shape[1], width: shape[2], colours: shape[3], values };
}

export function onePart({ shape, data, scale }, part, gain) {
  const count = data.length / 3, values = new Float32Array(count), offset = part * count;
  for (let i = 0; i < count; i++) values[i] = gain / scale * FLOAT16_VALUES[data[offset + i]];
  return { height: shape[1], width: shape[2], colours: shape[3], values };
}

// Keep one row and column in every few, so that at most `maximumPixels` pixels are left.
export function shrink(picture, maximumPixels) {
  const step = Math.ceil(Math.sqrt(picture.height * picture.width / maximumPixels));
  if (step === 1) return picture;
  const height = Math.ceil(picture.height / step), width = Math.ceil(picture.width / step), { colours } = picture;
  const values = new Float32Array(height * width * colours);
  for (let y = 0, j = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      for (let c = 0; c < colours; c++) values[j++] = picture.values[((y * picture.width + x) * step) * colours + c];
  return { height, width, colours, values };
}

// In grey if the look is that of one channel.
export function drawPicture(canvas, { height, width, colours, values }, { exposure, gamma, channel = '' }) {
  const tone = toneCurve(gamma), scale = 2 ** exposure;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext('2d', { willReadFrequently: true }), image = pen.createImageData(width, height), out = image.data;
  const byteOf = v => tone[v <= 0 ? 0 : Math.min(TONE_STEPS, TONE_STEPS * Math.sqrt(v * scale) + 0.5 | 0)];
  if (colours === 1 || channel)
    for (let i = colours === 1 ? 0 : CHANNELS.indexOf(channel) - 1, j = 0; i < values.length; i += colours, j += 4) {
      out[j] = out[j + 1] = out[j + 2] = byteOf(values[i]); out[j + 3] = 255;
    }
  else
    for (let i = 0, j = 0; i < values.length; i += 3, j += 4) {
      out[j] = byteOf(values[i]); out[j + 1] = byteOf(values[i + 1]); out[j + 2] = byteOf(values[i + 2]);
      out[j + 3] = 255;
    }
  pen.putImageData(image, 0, 0);
}

// Bytes of the screen by the level of a light times one channel of its colour; the newest three are kept.
const tonesOfLevels = new Map();

function toneOfLevels(share) {
  if (!tonesOfLevels.has(share)) {
    const tone = toneCurve(1), bytes = new Uint8ClampedArray(WHITE_LEVEL + 1);
    for (let i = 0; i <= WHITE_LEVEL; i++) bytes[i] = tone[TONE_STEPS * Math.sqrt(i / WHITE_LEVEL * share) + 0.5 | 0];
    if (tonesOfLevels.size >= 3) tonesOfLevels.delete(tonesOfLevels.keys().next().value);
    tonesOfLevels.set(share, bytes);
  }
  return tonesOfLevels.get(share);
}

// Draws a light's levels, or those that changed if the canvas shows the others, { top, left, bottom, right }.
export function drawLight(canvas, { height, width, everything, channels, values }, colour, changed) {
  const isNew = canvas.width !== width || canvas.height !== height;
  if (isNew) Object.assign(canvas, { width, height });
  const { top, left, bottom, right } = !isNew && changed || everything;
  if (top >= bottom || left >= right) return;
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  const image = pen.createImageData(right - left, bottom - top), out = image.data;
  const [red, green, blue] = colour.map(toneOfLevels), step = channels === 3 ? 1 : 0;
  for (let y = top, j = 0; y < bottom; y++) {
    const end = (y * width + right) * channels;
    for (let i = (y * width + left) * channels; i < end; i += channels, j += 4) {
      out[j] = red[values[i]]; out[j + 1] = green[values[i + step]]; out[j + 2] = blue[values[i + 2 * step]];
      out[j + 3] = 255;
    }
  }
  pen.putImageData(image, left, top);
}

// The exposure, in stops, at which all but one value in two hundred are below white.
export function exposureFor({ values }) {
  const stride = Math.max(1, Math.floor(values.length / 20000)), sample = [];
  for (let i = 0; i < values.length; i += stride) sample.push(values[i]);
  sample.sort((a, b) => a - b);
  const bright = sample[Math.floor(0.995 * (sample.length - 1))];
  return bright > 0 ? Math.max(-6, Math.min(12, Math.round(10 * Math.log2(0.95 / bright)) / 10)) : 0;
}
