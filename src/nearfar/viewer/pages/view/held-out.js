// How far the transport is off at photos that no estimate used, at one camera pixel.

import { requestMessage } from './protocol.js';

const NAME = 'held-out';

export class HeldOut {
  #map = null;

  // onRead: the map has come.
  constructor({ scene, onRead }) {
    if (!scene.maps.some(({ name }) => name === NAME)) return;
    this.#read(onRead);
  }

  async #read(onRead) {
    try {
      const { header: { unit }, arrays: [values] } = await requestMessage(`map/${NAME}`);
      this.#map = { ...values, unit };
      onRead();
    } catch { /* a map that cannot be made says so where it is chosen */ }
  }

  // In words; '' where it is not known.
  at([y, x], [height, width]) {
    if (!this.#map) return '';
    const { shape: [rows, columns], data, unit } = this.#map;
    const value = data[Math.min(rows - 1, Math.floor(y * rows / height)) * columns + Math.min(columns - 1, Math.floor(x * columns / width))];
    return Number.isFinite(value) ? `${value.toPrecision(2)} ${unit}` : '';
  }
}
