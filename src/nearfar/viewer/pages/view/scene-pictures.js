// The scene under the light, its three parts, and the reference beside it.

import { compare, describeDifference, drawDifference, rangeAt } from './difference.js';
import { get, set } from './dom.js';
import { FrameStatus } from './frame-status.js';
import { drawPicture, exposureFor, fromFloat16, onePart, shrink, sumOfParts } from './picture.js';
import { SPLITS, gainsOf } from './state.js';

const MAXIMUM_PIXELS_OF_A_PART = 65536;

export class ScenePictures {
  #camera;
  #frame = null;
  #reference = null;
  // In place of the relit scene.
  #stage = null;
  #status = new FrameStatus();
  #frameCount = 0;
  #aspect = 0;

  constructor(camera) {
    this.#camera = camera;
    Object.assign(this, { isStageFinal: false, referenceName: '' });
  }

  get hasReference() { return this.#reference !== null; }

  // The split of the newest frame.
  get split() { return this.#frame?.split || 'model'; }

  // Whether the picture is exact.
  get isExact() { return Boolean(this.#frame?.exact); }

  // Whether it is, and of the newest light; or whether the picture in its place is.
  get isFinal() { return this.#stage ? this.isStageFinal : this.isExact && this.#frame.isNewest; }

  // The light has changed: the picture is of an older one.
  lightChanged() {
    if (!this.#frame) return;
    this.#frame.isNewest = false;
    this.#describeFrame();
  }

  receive(header, parts, isNewest, state) {
    this.#frame = { exact: header.exact, split: header.split, isNewest, parts: { ...parts, scale: header.scale } };
    this.#status.arrived(header);
    this.draw(state);
    this.#frameCount += 1;
    this.#describeFrame();
  }

  // For those who drive the page by a program.
  #describeFrame() {
    if (!this.#frame) return;
    const { exact, split, isNewest } = this.#frame;
    document.body.dataset.frame = JSON.stringify({ count: this.#frameCount, exact, newest: isNewest, split, stage: this.#stage ? this.isStageFinal : null });
  }

  draw(state) {
    if (!this.#frame) return;
    const picture = this.#picture(state), [height, width] = this.#stage?.ofProjector ? [picture.height, picture.width] : this.#camera;
    this.#shape(width / height);
    if (!this.#drawDifference(picture, state)) drawPicture(get('picture'), picture, this.#stage?.look || state);
    SPLITS[this.split].forEach((name, i) =>
      drawPicture(get('part' + i), shrink(onePart(this.#frame.parts, i, state[name]), MAXIMUM_PIXELS_OF_A_PART), state));
    this.#drawReference(state);
    this.#markPixel(state.pixel);
  }

  // Compares with the picture as it is, if it is exact; returns whether it is.
  keepAsReference(state) {
    if (this.isExact) this.compareWith(this.#picture(state), 'kept');
    return this.isExact;
  }

  compareWith(picture, name) {
    this.#reference = picture;
    this.referenceName = name;
  }

  removeReference() { this.compareWith(null, ''); }

  // Shows another picture in place of the relit scene, until the next one; the relit scene again for null.
  // isFinal: whether nothing finer will follow; ofProjector: whether it is one of projector pixels; look: in place of the page's.
  replace(picture, isFinal, state, { ofProjector = false, look = null } = {}) {
    if (!picture && !this.#stage) return;
    this.#stage = picture && { picture, ofProjector, look };
    this.isStageFinal = isFinal;
    this.draw(state);
    this.#describeFrame();
  }

  // What is shown at a pixel [y, x] of a grid, and what the frame has there, colour by colour; null before there is one.
  valuesAt([y, x], [height, width]) {
    if (!this.#frame) return null;
    const { shape: [count, rows, columns, colours], data, scale } = this.#frame.parts, stage = this.#stage?.picture;
    const pick = (values, h, w, c, first = 0) => {
      const at = first + (Math.min(h - 1, Math.floor(y * h / height)) * w + Math.min(w - 1, Math.floor(x * w / width))) * c;
      return Array.from(values.slice(at, at + c));
    };
    const size = rows * columns * colours;
    const parts = Array.from({ length: count }, (_, i) => [...fromFloat16(pick(data, rows, columns, colours, i * size), scale)]);
    const total = parts[0].map((_, c) => parts.reduce((sum, part) => sum + part[c], 0));
    const shown = stage ? pick(stage.values, stage.height, stage.width, stage.colours) : total;
    return { shown, parts, total, split: this.split, isRelit: !stage };
  }

  // The exposure that suits the picture; null before there is one.
  exposure(state) { return this.#frame && exposureFor(this.#picture(state)); }

  // The relit scene, whatever is shown in its place.
  relit(state) { return this.#frame && sumOfParts(this.#frame.parts, gainsOf(state, this.split)); }

  #picture(state) { return this.#stage?.picture || this.relit(state); }

  #shape(aspect) {
    if (this.#aspect !== aspect) get('scene-view').style.setProperty('--aspect', aspect);
    this.#aspect = aspect;
  }

  get #isCompared() { return Boolean(this.#reference) && !this.#stage?.ofProjector; }

  // Tells how far the picture is from what it is compared with; draws the difference in its place and returns true if that
  // is wanted.
  #drawDifference(picture, state) {
    if (!this.#isCompared) return false;
    const compared = compare(picture, this.#reference);
    describeDifference(compared, state);
    if (state.difference) drawDifference(get('picture'), compared, rangeAt(state));
    return state.difference;
  }

  #drawReference(state) {
    if (this.#reference) drawPicture(get('before'), this.#reference, state);
    for (const id of ['before', 'edge']) set(get(id), 'hidden', !this.#isCompared || state.difference);
    set(get('before').style, 'clipPath', `inset(0px ${100 - state.wipe}% 0px 0px)`);
    set(get('edge').style, 'left', `calc(${state.wipe}% - 1px)`);
  }

  #markPixel(pixel) {
    const [height, width] = this.#camera;
    const isThere = pixel && !this.#stage?.ofProjector;
    set(get('mark'), 'hidden', !isThere);
    if (!isThere) return;
    set(get('mark').style, 'left', 100 * (pixel[1] + 0.5) / width + '%');
    set(get('mark').style, 'top', 100 * (pixel[0] + 0.5) / height + '%');
  }
}
