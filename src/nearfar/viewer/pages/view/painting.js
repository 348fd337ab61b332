// What brush strokes paint on the projector's grid, in linear light.

import { linearColour } from './colour.js';
import { distance, smooth } from './shapes.js';

// How much of the paint below one dab of the brush covers.
const OPACITY = 0.6;
// The smallest brush covers whole single pixels.
export const ONE_PIXEL = 0.5;

const extendsStroke = (stroke, before) =>
  stroke?.colour === before.colour && stroke.radius === before.radius && stroke.points.length >= before.points.length &&
  before.points.every((value, i) => stroke.points[i] === value);

export class Painting {
  #height;
  #width;
  #painted = [];
  #changed;

  constructor(height, width) {
    this.#height = height;
    this.#width = width;
    // Red, green and blue of each pixel, from 0 to 1.
    this.values = new Float64Array(3 * height * width);
  }

  // Paints what was added since the last time, or all strokes if one is gone; returns the rows and columns that
  // changed, { top, left, bottom, right }, the last two not among them.
  paint(strokes) {
    this.#changed = { top: this.#height, left: this.#width, bottom: 0, right: 0 };
    const last = this.#painted.length - 1;
    const onlyAdded = this.#painted.every((before, i) =>
      strokes[i] === before || i === last && extendsStroke(strokes[i], before));
    if (!onlyAdded) {
      this.values.fill(0);
      this.#painted = [];
      this.#change(0, 0, this.#height - 1, this.#width - 1);
    }
    for (let i = Math.max(0, this.#painted.length - 1); i < strokes.length; i++)
      this.#continueStroke(strokes[i], this.#painted[i]?.points.length || 0);
    this.#painted = [...strokes];
    return this.#changed;
  }

  // Notes that rows and columns up to the last changed.
  #change(top, left, lastRow, lastColumn) {
    const changed = this.#changed;
    changed.top = Math.min(changed.top, Math.max(0, top));
    changed.left = Math.min(changed.left, Math.max(0, left));
    changed.bottom = Math.max(changed.bottom, Math.min(this.#height, lastRow + 1));
    changed.right = Math.max(changed.right, Math.min(this.#width, lastColumn + 1));
  }

  #continueStroke({ colour, radius, points }, painted) {
    const rgb = linearColour(colour);
    if (radius <= ONE_PIXEL) {
      this.#continueLine(points, painted, rgb);
      return;
    }
    if (painted === 0) this.#dab(points[0], points[1], radius, rgb);
    for (let i = Math.max(2, painted); i < points.length; i += 2) {
      const [x0, y0, x1, y1] = points.slice(i - 2, i + 2);
      const steps = Math.max(1, Math.ceil(Math.hypot(x1 - x0, y1 - y0) / (radius / 3)));
      for (let n = 1; n <= steps; n++)
        this.#dab(x0 + (x1 - x0) * n / steps, y0 + (y1 - y0) * n / steps, radius, rgb);
    }
  }

  // A line one pixel wide, without gaps.
  #continueLine(points, painted, rgb) {
    const places = points.map(Math.round);
    if (painted === 0) this.#setPixel(places[0], places[1], rgb);
    for (let i = Math.max(2, painted); i < places.length; i += 2) {
      const [x0, y0, x1, y1] = places.slice(i - 2, i + 2), steps = Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0));
      for (let n = 1; n <= steps; n++)
        this.#setPixel(Math.round(x0 + (x1 - x0) * n / steps), Math.round(y0 + (y1 - y0) * n / steps), rgb);
    }
  }

  #setPixel(x, y, rgb) {
    if (x < 0 || x >= this.#width || y < 0 || y >= this.#height) return;
    this.values.set(rgb, 3 * (y * this.#width + x));
    this.#change(y, x, y, x);
  }

  #dab(cx, cy, radius, rgb) {
    const reach = Math.ceil(radius) + 1;
    this.#change(Math.floor(cy) - reach, Math.floor(cx) - reach, Math.ceil(cy) + reach, Math.ceil(cx) + reach);
    for (let y = Math.max(0, Math.floor(cy) - reach); y <= Math.min(this.#height - 1, Math.ceil(cy) + reach); y++)
      for (let x = Math.max(0, Math.floor(cx) - reach); x <= Math.min(this.#width - 1, Math.ceil(cx) + reach); x++) {
        const cover = OPACITY * smooth((radius + 0.5 - distance(y - cy, x - cx)) / (0.7 * radius + 0.5));
        const i = 3 * (y * this.#width + x);
        for (let c = 0; c < 3; c++) this.values[i + c] += cover * (rgb[c] - this.values[i + c]);
      }
  }
}
