// The lamps of a light stage at their directions: those beside the camera in the middle, those aside on the circle.

import { get } from './dom.js';

const SIDE = 320, RADIUS = 145, DOT = 8;

const angleOf = ([, , z]) => Math.acos(Math.max(-1, Math.min(1, z)));

// Where a direction [x, y, z] lies on the disc: x to the right, y up, z towards the camera, the angle from z its radius.
function placeOf([x, y, z], widest) {
  const across = Math.hypot(x, y) || 1, radius = RADIUS * angleOf([x, y, z]) / widest;
  return [SIDE / 2 + radius * x / across, SIDE / 2 - radius * y / across];
}

export class Lamps {
  #places;
  #aside;

  constructor({ directions }) {
    const widest = Math.max(Math.PI / 2, ...(directions || []).map(angleOf));
    this.#places = (directions || []).map(direction => placeOf(direction, widest));
    this.#aside = RADIUS * Math.PI / 2 / widest;
    get('lamps').hidden = !directions;
  }

  // Draws each lamp in its colour on the light's canvas, which has a pixel for each.
  draw() {
    if (!this.#places.length) return;
    const canvas = get('lamps'), pen = canvas.getContext('2d');
    Object.assign(canvas, { width: SIDE, height: SIDE });
    pen.strokeStyle = '#888';
    pen.beginPath();
    pen.arc(SIDE / 2, SIDE / 2, this.#aside, 0, 2 * Math.PI);
    pen.stroke();
    const levels = get('light').getContext('2d', { willReadFrequently: true }).getImageData(0, 0, this.#places.length, 1).data;
    this.#places.forEach(([x, y], n) => {
      pen.fillStyle = `rgb(${levels.slice(4 * n, 4 * n + 3).join(' ')})`;
      pen.beginPath();
      pen.arc(x, y, DOT, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    });
  }

  // A click lights the nearest lamp alone.
  bind(store) {
    get('lamps').onclick = event => {
      const box = event.target.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * SIDE, y = (event.clientY - box.top) / box.height * SIDE;
      const distances = this.#places.map(([px, py]) => Math.hypot(px - x, py - y));
      store.update({ kind: 'pixel', x: distances.indexOf(Math.min(...distances)), y: 0 });
    };
  }
}
