// The light on the projector's grid, as it is sent: levels of one channel or three, times a colour.

import { LINEAR_OF_BYTE, WHITE_LEVEL, linearColour } from './colour.js';
import { Painting } from './painting.js';
import { shapeOf } from './shapes.js';

export class Light {
  #grey;
  #coloured;
  #painting;
  #pictures = [];

  constructor([height, width]) {
    Object.assign(this, { height, width, colour: [1, 1, 1] });
    this.#grey = new Uint16Array(height * width);
    this.#coloured = new Uint16Array(height * width * 3);
    this.#painting = new Painting(height, width);
    this.levels = this.#grey;
  }

  get shape() { return [this.height, this.width, this.levels === this.#grey ? 1 : 3]; }

  // Pictures that were dropped on the page.
  get pictureCount() { return this.#pictures.length; }

  draw(state) {
    if (state.kind === 'paint') this.#drawPaint(state.strokes);
    else if (state.kind === 'picture') this.#drawPicture(state.shown);
    else this.#drawShape(state);
  }

  #drawShape(state) {
    this.levels = this.#grey;
    this.colour = linearColour(state.kind === 'white' ? '#ffffff' : state.colour);
    const brightness = shapeOf(state, this.height, this.width);
    for (let y = 0, i = 0; y < this.height; y++)
      for (let x = 0; x < this.width; x++) this.#grey[i++] = Math.round(WHITE_LEVEL * brightness(x, y));
  }

  #drawPaint(strokes) {
    this.#painting.paint(strokes);
    const { values } = this.#painting;
    // Strokes of one colour are sent as one channel, which relights as quickly as a shape.
    const isOneColour = strokes.every(stroke => stroke.colour === strokes[0].colour);
    this.levels = isOneColour ? this.#grey : this.#coloured;
    this.colour = linearColour(isOneColour && strokes[0]?.colour || '#ffffff');
    if (isOneColour) {
      const brightest = this.colour.indexOf(Math.max(...this.colour)), full = this.colour[brightest] || 1;
      for (let i = 0; i < this.#grey.length; i++) this.#grey[i] = Math.round(WHITE_LEVEL * values[3 * i + brightest] / full);
    } else for (let i = 0; i < this.#coloured.length; i++) this.#coloured[i] = Math.round(WHITE_LEVEL * values[i]);
  }

  #drawPicture(index) {
    this.levels = this.#coloured;
    this.colour = [1, 1, 1];
    const picture = this.#pictures[Math.min(Math.max(Math.round(index), 0), this.#pictures.length - 1)];
    if (picture) this.#coloured.set(picture);
    else this.#coloured.fill(0);
  }

  // Levels of a picture of the grid's size, in linear light.
  addLinear(levels) { this.#pictures.push(levels.slice()); }

  // In place of a picture that the address does not hold.
  addMissing() { this.#pictures.push(new Uint16Array(this.#coloured.length)); }

  // An sRGB picture of any size, cropped to the grid; returns it as a data URL for the address.
  async addPicture(source) {
    const canvas = new OffscreenCanvas(this.width, this.height);
    const pixels = await drawToFill(canvas, source);
    const levels = new Uint16Array(this.#coloured.length);
    for (let i = 0, j = 0; j < levels.length; i += 4)
      for (let c = 0; c < 3; c++) levels[j++] = Math.round(WHITE_LEVEL * LINEAR_OF_BYTE[pixels[i + c]] * pixels[i + 3] / 255);
    this.#pictures.push(levels);
    const blob = await canvas.convertToBlob({ type: 'image/png' });
    return 'data:image/png;base64,' + btoa(Array.from(new Uint8Array(await blob.arrayBuffer()),
      byte => String.fromCharCode(byte)).join(''));
  }
}

async function drawToFill(canvas, source) {
  const bitmap = await createImageBitmap(source), pen = canvas.getContext('2d', { willReadFrequently: true });
  const scale = Math.max(canvas.width / bitmap.width, canvas.height / bitmap.height);
  const width = bitmap.width * scale, height = bitmap.height * scale;
  pen.imageSmoothingQuality = 'high';
  pen.drawImage(bitmap, (canvas.width - width) / 2, (canvas.height - height) / 2, width, height);
  bitmap.close();
  return pen.getImageData(0, 0, canvas.width, canvas.height).data;
}
