// The scene under the light, its three parts, and the reference beside it.

import { showComparison } from './comparison.js';
import { compare, describeDifference, drawDifference, rangeOf } from './difference.js';
import { get } from './dom.js';
import { FrameStatus, describeFrame } from './frame-status.js';
import { drawPicture, exposureFor, shrink, sumOfParts } from './picture.js';
import { valuesAt } from './picture-values.js';
import { markPixel } from './stage-marks.js';
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

  // others: pictures of other projectors, which are added to this one's. onReplaced() is called once another picture is shown in place of the relit scene.
  constructor(camera, onReplaced) {
    this.#camera = camera;
    Object.assign(this, { isStageFinal: false, referenceName: '', others: null, onReplaced });
  }

  get hasReference() { return this.#reference !== null; }

  // The split of the newest frame.
  get split() { return this.#frame?.split || 'model'; }

  get isExact() { return Boolean(this.#frame?.exact) && this.others.isReady(this.split); }

  // Whether the picture is exact, and of the newest light; or whether the picture in its place is.
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
    this.#frameCount += 1;
    this.draw(state);
  }

  #describeFrame() { describeFrame({ ...this.#frame, exact: this.isExact }, this.#frameCount, this.#stage ? this.isStageFinal : null); }

  draw(state) {
    if (!this.#frame) return;
    const picture = this.#picture(state), [height, width] = this.#stage?.ofProjector ? [picture.height, picture.width] : this.#camera;
    this.#shape(width / height);
    if (this.#stage?.paint) this.#stage.paint(get('picture'));
    else if (!this.#drawDifference(picture, state)) drawPicture(get('picture'), picture, this.#stage?.look || state);
    SPLITS[this.split].forEach((name, i) =>
      drawPicture(get('part' + i), shrink(this.others.part(this.#frame.parts, i, state[name], this.split), MAXIMUM_PIXELS_OF_A_PART), state));
    this.#drawReference(state);
    markPixel(this.#stage?.ofProjector ? null : state.pixel, this.#camera);
    this.#describeFrame();
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

  // Whether a picture is what the scene is compared with.
  isReference(picture) { return picture === this.#reference; }

  // Whether what it is compared with stands beside it.
  isPair(state) { return this.isCompared && state.arrangement === 'pair' && !state.difference; }

  // What it is compared with, at a camera pixel, colour by colour; null if there is none.
  referenceAt(place) {
    return this.isCompared && this.#reference.isCurrent !== false ? valuesAt(this.#reference, place, this.#camera) : null;
  }

  // Shows another picture in place of the relit scene, until the next one; the relit scene again for null.
  // isFinal: whether nothing finer will follow; ofProjector: whether it is one of projector pixels; look: in place of the page's;
  // paint(canvas): draws what is no light; textOf(value): its values in words.
  replace(picture, isFinal, state, { ofProjector = false, look = null, paint = null, textOf = null } = {}) {
    if (!picture && !this.#stage) return;
    this.#stage = picture && { picture, ofProjector, look, paint, textOf };
    this.isStageFinal = isFinal;
    this.draw(state);
    this.onReplaced();
  }

  // What is shown at a pixel [y, x] of a grid, and what the frame has there, colour by colour; null before there is one.
  valuesAt(place, size) {
    if (!this.#frame) return null;
    const found = this.others.valuesAt(this.#frame.parts, place, size, this.split), stage = this.#stage?.picture;
    return { ...found, shown: stage ? valuesAt(stage, place, size) : found.sum, split: this.split, isRelit: !stage, textOf: this.#stage?.textOf };
  }

  // The exposure that suits the picture; null before there is one.
  exposure(state) { return this.#frame && exposureFor(this.#stage?.paint ? this.relit(state) : this.#picture(state)); }

  // The relit scene, whatever is shown in its place.
  relit(state) { return this.#frame && this.others.relit(this.#frame.parts, gainsOf(state, this.split), this.split); }

  #picture(state) { return this.#stage?.picture || this.relit(state); }

  #shape(aspect) {
    if (this.#aspect !== aspect) get('scene-view').style.setProperty('--aspect', aspect);
    this.#aspect = aspect;
  }

  // What is shown in place of the relit scene, and all light; null before both are exact, and where it is no light of camera pixels.
  get shownAndTotal() {
    const isExact = this.#stage && !this.#stage.ofProjector && !this.#stage.paint && this.isFinal && this.#frame.isNewest;
    return isExact ? [this.#stage.picture, sumOfParts(this.#frame.parts, [1, 1, 1])] : null;
  }

  // Whether there is light of the camera's pixels on the stage, and something to compare it with.
  get isCompared() { return Boolean(this.#reference) && !this.#stage?.ofProjector && !this.#stage?.paint; }

  // Tells how far the picture is from what it is compared with; draws the difference in its place and returns true if that
  // is wanted.
  #drawDifference(picture, state) {
    if (!this.isCompared) return false;
    const compared = compare(picture, this.#reference), isUnderWay = this.#reference.isCurrent !== undefined && !(this.#reference.isCurrent && this.isFinal);
    const { difference } = state, range = difference ? rangeOf(compared, state) : 0;
    describeDifference(compared, { difference, range }, isUnderWay);
    if (difference) drawDifference(get('picture'), compared, range);
    return difference;
  }

  #drawReference(state) {
    if (this.#reference) drawPicture(get('before'), this.#reference, state);
    showComparison(state, { isCompared: this.isCompared, isPair: this.isPair(state), name: this.referenceName });
  }
}
