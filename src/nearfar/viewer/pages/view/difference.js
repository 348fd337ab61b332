// The picture less what it is compared with: how far they are apart, and where, by sign.

import { get, set } from './dom.js';

// More light than the reference is orange, less is blue, none is grey.
const MORE = [255, 140, 40], NONE = [40, 40, 44], LESS = [70, 150, 255];

const places = (picture, { height, width }) => (y, x) =>
  (Math.floor(y * picture.height / height) * picture.width + Math.floor(x * picture.width / width)) * picture.colours;

// The mean over colours of a picture less a reference, at the reference's pixels, and the signal-to-noise ratio in dB.
export function compare(picture, reference) {
  const { height, width } = reference, at = places(picture, reference), values = new Float32Array(height * width);
  let signal = 0, noise = 0;
  for (let y = 0, i = 0, j = 0; y < height; y++)
    for (let x = 0; x < width; x++, i++) {
      const first = at(y, x);
      for (let c = 0; c < reference.colours; c++, j++) {
        const off = picture.values[first + Math.min(c, picture.colours - 1)] - reference.values[j];
        signal += reference.values[j] ** 2;
        noise += off ** 2;
        values[i] += off / reference.colours;
      }
    }
  return { height, width, values, snr: noise > 0 ? 10 * Math.log10(signal / noise) : Infinity };
}

// The colours' full strength is at `range`.
export function drawDifference(canvas, { height, width, values }, range) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext('2d', { willReadFrequently: true }), image = pen.createImageData(width, height);
  for (let i = 0, j = 0; i < values.length; i++, j += 4) {
    const share = Math.min(1, Math.abs(values[i]) / range), full = values[i] > 0 ? MORE : LESS;
    for (let c = 0; c < 3; c++) image.data[j + c] = NONE[c] + share * (full[c] - NONE[c]);
    image.data[j + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
}

// A tenth of what is white at an exposure.
export const rangeAt = ({ exposure }) => 0.1 * 2 ** -exposure;

export function describeDifference(compared, state) {
  const apart = Number.isFinite(compared.snr) ? `SNR ${compared.snr.toFixed(1)} dB` : 'equal';
  const range = rangeAt(state).toPrecision(2);
  set(get('snr'), 'textContent', state.difference ? `${apart}; orange ${range} more than the reference, blue ${range} less` : apart);
}
