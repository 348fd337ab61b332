// A second transport under the same light: its picture is what the scene is compared with, and follows the light.

import { BackgroundJob } from './background.js';
import { shareThePointer } from './comparison.js';
import { get, set } from './dom.js';
import { pictureOf, sumOfParts } from './picture.js';
import { pack, requestMessage } from './protocol.js';
import { SPLITS, gainsOf } from './state.js';

export class Beside {
  #page;
  #second;
  #job = new BackgroundJob(text => set(get('beside-status'), 'textContent', text === 'computing' ? '' : text));
  // The newest answer { header, parts }, its picture, and the gains of that.
  #found = null;
  #picture = null;
  #gains = '';
  #isCurrent = false;
  #lights = 0;

  constructor(page) {
    this.#page = page;
    this.#second = page.scene.beside;
    get('compare-beside').hidden = !this.#second;
    shareThePointer();
    get('arrangement').onclick = () =>
      page.store.update({ arrangement: page.store.state.arrangement === 'pair' ? 'wipe' : 'pair', difference: false });
    if (!this.#second) return;
    get('compare-beside').textContent = `compare with ${this.#second.name}`;
    get('compare-beside').onclick = () => this.compare();
    get('beside-remark').textContent = this.#second.remark;
  }

  // Makes the second transport what the scene is compared with.
  compare() {
    if (!this.#second) return;
    // Something dark stands in until its picture comes.
    const { scene: { camera: [height, width] }, scenePictures, store } = this.#page;
    this.#picture = { height, width, colours: 1, values: new Float32Array(height * width), isCurrent: false };
    this.#gains = '';
    scenePictures.compareWith(this.#picture, this.#second.name);
    store.update({});
    this.#ask();
  }

  get #isCompared() { return Boolean(this.#picture) && this.#page.scenePictures.isReference(this.#picture); }

  lightChanged() {
    this.#isCurrent = false;
    this.#lights += 1;
    if (!this.#isCompared) return;
    this.#picture.isCurrent = false;
    // A light of blocks moves: the second picture comes once it rests.
    if (this.#page.light.sent.block === 1) this.#ask();
  }

  show() {
    if (!this.#second) return;
    set(get('compare-beside'), 'hidden', this.#isCompared);
    set(get('beside-remark'), 'hidden', !this.#isCompared);
    if (this.#isCompared && this.#found) this.#put();
  }

  #ask() {
    this.#job.ask([async signal => {
      const number = this.#lights, { sent: { values, shape }, colour } = this.#page.light;
      const { header, arrays: [parts] } = await requestMessage('tool/beside', { method: 'POST', body: pack({ shape, colour }, values), signal });
      this.#found = { header, parts };
      this.#gains = '';
      this.#isCurrent = number === this.#lights;
      this.#put();
    }]);
  }

  // Makes its picture what the scene is compared with, with the gains of the model's components.
  #put() {
    const { store: { state }, scenePictures } = this.#page;
    if (!this.#isCompared) return;
    const gains = scenePictures.split === 'model' && this.#second.is_apart ? gainsOf(state, 'model') : SPLITS.model.map(() => 1);
    const key = gains.join();
    if (this.#gains === key) return;
    this.#gains = key;
    const { header: { scale }, parts: { shape, data } } = this.#found, [, height, width, colours] = shape;
    const picture = this.#second.is_apart ? sumOfParts({ shape, data, scale }, gains) : pictureOf({ shape: [height, width, colours], data }, scale);
    this.#picture = { ...picture, isCurrent: this.#isCurrent };
    scenePictures.compareWith(this.#picture, this.#second.name);
    scenePictures.draw(state);
  }
}
