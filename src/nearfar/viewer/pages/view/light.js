// The light on the projector's grid, as it is shown and sent: levels of one channel or three, times a colour.

import { LINEAR_OF_BYTE, WHITE_LEVEL, linearColour } from './colour.js';
import { Levels } from './levels.js';
import { Painting } from './painting.js';
import { finestOf, shapeOf } from './shapes.js';

const range = count => Array.from({ length: count }, (_, i) => i);

export class Light {
  #whole;
  #blocks;
  #painting;
  #pictures = [];
  // The values that hold what is painted, until something else is drawn on them.
  #painted = null;

  // While it moves, the light is one of blocks of block x block pixels.
  constructor([height, width], block = 1) {
    Object.assign(this, { height, width, colour: [1, 1, 1], changed: null });
    this.#whole = new Levels([height, width], 1);
    this.#blocks = block > 1 ? new Levels([height, width], block) : this.#whole;
    this.#painting = new Painting(height, width);
    this.shown = this.sent = this.#whole;
  }

  // One of the same pictures, to draw on beside this one.
  another() {
    const light = new Light([this.height, this.width]);
    light.#pictures = this.#pictures;
    return light;
  }

  // Draws every projector pixel.
  draw(state) { this.#drawOn(this.#whole, state); }

  // Draws a light that moves, and soon moves on.
  drawMoving(state) { this.#drawOn(this.#blocks, state); }

  #drawOn(levels, state) {
    this.sent = this.shown = levels;
    this.changed = null;
    if (state.blend) { this.#drawBlend(levels, state); return; }
    if (state.kind === 'paint') { this.#drawPaint(state.strokes); return; }
    this.#painted = null;
    if (state.kind === 'picture') this.#drawPicture(levels, state.pictures[state.shown]?.number);
    else this.#drawShape(levels, state);
  }

  // A share of one light and the rest of another.
  #drawBlend(levels, { blend: { from, to, share }, pictures }) {
    const whole = this.#whole, mixed = new Float32Array(3 * this.height * this.width);
    for (const [light, weight] of [[from, 1 - share], [to, share]]) {
      this.#drawOn(whole, { ...light, pictures, blend: null });
      const { values, channels } = whole, tint = this.colour.map(value => weight * value);
      for (let i = 0; i < mixed.length; i++) mixed[i] += tint[i % 3] * values[channels === 3 ? i : Math.floor(i / 3)];
    }
    whole.ofChannels(3).forEach((_, i, values) => { values[i] = Math.round(mixed[i]); });
    if (levels !== whole) levels.average(whole, whole.everything);
    Object.assign(this, { sent: levels, shown: levels, changed: null, colour: [1, 1, 1] });
    this.#painted = null;
  }

  #drawShape(levels, state) {
    const { height, width } = this, { block } = levels, brightness = shapeOf(state, height, width);
    this.colour = linearColour(state.kind === 'white' ? '#ffffff' : state.colour);
    if (block === 1) { levels.fill(brightness); return; }
    // Four pixels stand for a block of a shape that is not fine.
    const isFine = finestOf(state, height, width) < 2 * block, step = Math.floor(block / 4);
    levels.fillMeans(brightness, isFine ? range(block) : [step, block - 1 - step], [height, width]);
  }

  // Only what was added is drawn: every pixel that is seen, and the blocks that are sent.
  #drawPaint(strokes) {
    let changed = this.#painting.paint(strokes);
    // Strokes of one colour are sent as one channel, which relights as quickly as a shape.
    const isOneColour = strokes.every(stroke => stroke.colour === strokes[0].colour);
    const values = this.#whole.ofChannels(isOneColour ? 1 : 3);
    this.colour = linearColour(isOneColour && strokes[0]?.colour || '#ffffff');
    if (this.#painted !== values) changed = this.#whole.everything;
    this.#painted = values;
    this.#setPainted(values, changed, isOneColour);
    if (this.#blocks !== this.#whole) this.#blocks.average(this.#whole, changed);
    Object.assign(this, { shown: this.#whole, changed });
  }

  #setPainted(values, { top, left, bottom, right }, isOneColour) {
    const painted = this.#painting.values, brightest = this.colour.indexOf(Math.max(...this.colour));
    const full = this.colour[brightest] || 1;
    for (let y = top; y < bottom; y++) {
      const first = y * this.width + left, end = y * this.width + right;
      if (isOneColour)
        for (let i = first; i < end; i++) values[i] = Math.round(WHITE_LEVEL * painted[3 * i + brightest] / full);
      else
        for (let i = 3 * first; i < 3 * end; i++) values[i] = Math.round(WHITE_LEVEL * painted[i]);
    }
  }

  #drawPicture(levels, number) {
    this.colour = [1, 1, 1];
    const picture = this.#pictures[number];
    this.#whole.ofChannels(3);
    if (!picture) levels.ofChannels(3).fill(0);
    else if (levels === this.#whole) this.#whole.values.set(picture.levels);
    else levels.ofChannels(3).set(picture.inBlocks ||= this.#inBlocks(picture.levels));
  }

  #inBlocks(picture) {
    this.#whole.values.set(picture);
    this.#blocks.average(this.#whole, this.#whole.everything);
    return this.#blocks.values.slice();
  }

  // Levels of a picture of the grid's size, in linear light; like the others it returns { number, url }, no URL if the address
  // cannot hold the picture.
  addLinear(levels, url = '') { return this.#addLevels(levels.slice(), url); }

  // In place of a picture that the address does not hold.
  addMissing() { return this.#addLevels(new Uint16Array(3 * this.height * this.width)); }

  // Pictures stay when they are removed from the page, so that a removal can be undone.
  #addLevels(levels, url = '') { return { number: this.#pictures.push({ levels, inBlocks: null }) - 1, url }; }

  // An sRGB picture of any size, cropped to the grid.
  async addPicture(source) {
    const { canvas, levels } = await levelsOfPicture(source, this.width, this.height);
    const blob = await canvas.convertToBlob({ type: 'image/png' });
    return this.#addLevels(levels, 'data:image/png;base64,' + btoa(Array.from(new Uint8Array(await blob.arrayBuffer()),
      byte => String.fromCharCode(byte)).join('')));
  }
}

// An sRGB picture of any size as levels of red, green and blue, cropped to a size, and the canvas it was drawn on.
export async function levelsOfPicture(source, width, height) {
  const canvas = new OffscreenCanvas(width, height), pixels = await drawToFill(canvas, source);
  const levels = new Uint16Array(3 * height * width);
  for (let i = 0, j = 0; j < levels.length; i += 4)
    for (let c = 0; c < 3; c++) levels[j++] = Math.round(WHITE_LEVEL * LINEAR_OF_BYTE[pixels[i + c]] * pixels[i + 3] / 255);
  return { canvas, levels };
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
