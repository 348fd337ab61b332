// Levels of a light on a grid: whole projector pixels, or blocks of them.

import { WHITE_LEVEL } from './colour.js';

export class Levels {
  #grey;
  #coloured;

  constructor([height, width], block) {
    this.block = block;
    this.height = Math.ceil(height / block);
    this.width = Math.ceil(width / block);
    this.#grey = new Uint16Array(this.height * this.width);
    this.#coloured = new Uint16Array(this.height * this.width * 3);
    this.values = this.#grey;
  }

  get channels() { return this.values === this.#grey ? 1 : 3; }

  get shape() { return [this.height, this.width, this.channels]; }

  // Chooses one channel or three; returns the values, which are as they were left.
  ofChannels(channels) { return this.values = channels === 1 ? this.#grey : this.#coloured; }

  // Rows from top and columns from left on, up to but without bottom and right.
  get everything() { return { top: 0, left: 0, bottom: this.height, right: this.width }; }

  // Of brightness(x, y) at every pixel.
  fill(brightness) {
    const values = this.ofChannels(1);
    for (let y = 0, i = 0; y < this.height; y++)
      for (let x = 0; x < this.width; x++) values[i++] = Math.round(WHITE_LEVEL * brightness(x, y));
  }

  // Of the mean of brightness(x, y) over the rows and columns of a block that are given.
  fillMeans(brightness, samples, [height, width]) {
    const values = this.ofChannels(1), scale = WHITE_LEVEL / samples.length ** 2;
    for (let y = 0, i = 0; y < this.height; y++)
      for (let x = 0; x < this.width; x++) {
        let sum = 0;
        for (const down of samples)
          for (const across of samples)
            sum += brightness(Math.min(width - 1, x * this.block + across), Math.min(height - 1, y * this.block + down));
        values[i++] = Math.round(scale * sum);
      }
  }

  // The means of whole pixels over the blocks that some of them, { top, left, bottom, right }, lie in.
  average(whole, { top, left, bottom, right }) {
    const { block } = this, { channels } = whole, values = this.ofChannels(channels);
    for (let y = Math.floor(top / block); y < Math.ceil(bottom / block); y++)
      for (let x = Math.floor(left / block); x < Math.ceil(right / block); x++) {
        const lastY = Math.min(whole.height, (y + 1) * block), lastX = Math.min(whole.width, (x + 1) * block);
        const count = (lastY - y * block) * (lastX - x * block);
        for (let c = 0; c < channels; c++) {
          let sum = 0;
          for (let v = y * block; v < lastY; v++)
            for (let u = x * block; u < lastX; u++) sum += whole.values[(v * whole.width + u) * channels + c];
          values[(y * this.width + x) * channels + c] = Math.round(sum / count);
        }
      }
  }
}
