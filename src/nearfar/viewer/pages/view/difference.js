// The picture less what it is compared with: how far they are apart, and where, by sign.

import { get, set } from './dom.js';
import { drawBar, numberText, usualRange } from './false-colour.js';

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

// The colours' full strength is at the range.
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

// What was typed, or what one camera pixel in a hundred is beyond, in two digits; of equal pictures a tenth of what is white.
export function rangeOf({ values }, { exposure, ranges }) {
  if (ranges.difference?.high) return ranges.difference.high;
  const { high } = usualRange(values.map(Math.abs), true);
  return values.some(Boolean) ? Number(high.toPrecision(2)) : 0.1 * 2 ** -exposure;
}

// isUnderWay: one of the two pictures is not there yet.
export function describeDifference(compared, { difference, range }, isUnderWay) {
  const apart = isUnderWay ? 'SNR follows' : Number.isFinite(compared.snr) ? `SNR ${compared.snr.toFixed(1)} dB` : 'equal';
  set(get('snr'), 'textContent', difference ? `${apart}; orange ${numberText(range)} more than the reference, blue ${numberText(range)} less` : apart);
  if (difference) drawBar(get('difference-figure'), [LESS, NONE, MORE], [-range, 0, range].map(numberText));
}
