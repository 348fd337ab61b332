// Other projectors before the same camera: each has a page and a light of its own, and its picture is added to that of this page.

import { showFault } from './dom.js';
import { nameOf } from './file-names.js';
import { onePart, sumOfParts } from './picture.js';
import { add } from './picture-sums.js';
import { partsAt, valuesAt } from './picture-values.js';
import { pack, request, requestMessage } from './protocol.js';
import { SPLITS, numberOf } from './state.js';

export class OtherProjectors {
  #store;
  #here;
  #others;
  #onArrived;
  // Parts of pictures by projector and split, or the promise of them.
  #found = new Map();
  // The sum of the others that is shown, and what it is of.
  #sum = { key: '', picture: null };

  // onArrived() is called once the picture of another one is there.
  constructor({ scene, store, others, onArrived }) {
    this.#store = store;
    this.#here = numberOf(scene.projectors);
    this.#others = others;
    this.#onArrived = onArrived;
  }

  get #lit() { return this.#others.filter(({ number }) => this.#store.state.lit.includes(number)); }

  // Whether this page's projector is lit; its light counts as black if not.
  get isLit() { return !this.#others.length || this.#store.state.lit.includes(this.#here); }

  get litCount() { return this.#lit.length + (this.isLit ? 1 : 0); }

  // Whether the picture is not of this page's light alone.
  get isSum() { return this.#lit.length > 0 || !this.isLit; }

  // Those that are lit, as files: { transport, light }.
  get files() {
    return this.#lit.map(({ name, scene, state }) => ({ transport: name, light: `${nameOf({ scene, store: { state } })}.light.png` }));
  }

  // Whether the pictures of all that are lit are there; asks for those that are not.
  isReady(split) {
    this.#forgetFaults();
    const waiting = this.#lit.filter(other => !this.#partsOf(other, split));
    for (const other of waiting) this.#ask(other, split);
    return !waiting.length;
  }

  #partsOf({ number }, split) {
    const found = this.#found.get(`${number} ${split}`);
    return found?.data ? found : null;
  }

  // What could not be had is asked for again once its projector was switched off and on.
  #forgetFaults() {
    const { lit } = this.#store.state;
    for (const [key, { failedFor }] of this.#found) if (failedFor !== undefined && !lit.includes(failedFor)) this.#found.delete(key);
  }

  async #ask({ number, name, path, light }, split) {
    const key = `${number} ${split}`;
    if (this.#found.has(key)) return;
    this.#found.set(key, {});
    try {
      if (split === 'physical') await request(`${path}split`, { method: 'POST' });
      const { sent: { values, shape }, colour } = light;
      const { header, arrays: [parts] } = await requestMessage(`${path}tool/parts`, { method: 'POST', body: pack({ shape, colour, split }, values) });
      this.#found.set(key, { ...parts, scale: header.scale });
      this.#onArrived();
    } catch (error) {
      this.#found.set(key, { failedFor: number });
      showFault(`${name}: ${error.message}`, name);
    }
  }

  #pictures(split, of) { return this.#lit.map(other => this.#partsOf(other, split)).filter(Boolean).map(of); }

  // Gains of this page's projector.
  #own(gains) { return this.isLit ? gains : gains.map(() => 0); }

  // The picture of parts of this page's projector and of the others', with gains of the components.
  relit(parts, gains, split) {
    const picture = sumOfParts(parts, this.#own(gains));
    this.isReady(split);
    const there = this.#lit.filter(other => this.#partsOf(other, split)), key = [gains, split, there.map(({ number }) => number)].join(' ');
    if (this.#sum.key !== key) {
      const [first, ...rest] = this.#pictures(split, each => sumOfParts(each, gains));
      this.#sum = { key, picture: first ? add(first, rest) : null };
    }
    return this.#sum.picture ? add(picture, [this.#sum.picture]) : picture;
  }

  // The same of one component.
  part(parts, i, gain, split) { return add(onePart(parts, i, ...this.#own([gain])), this.#pictures(split, each => onePart(each, i, gain))); }

  // Light at a camera pixel, colour by colour: of each component and in total by this page's projector, of each of the others that is
  // lit with its name, and the sum of all that are lit.
  valuesAt(frameParts, place, size, split) {
    const gains = SPLITS[split].map(() => 1), parts = partsAt(frameParts, place, size);
    const total = parts[0].map((_, c) => parts.reduce((sum, part) => sum + part[c], 0));
    const others = this.#lit.filter(other => this.#partsOf(other, split)).map(other =>
      [other.name, valuesAt(sumOfParts(this.#partsOf(other, split), gains), place, size)]);
    return { parts, total, others, sum: others.reduce((sum, [, light]) => sum.map((value, c) => value + light[c]), this.#own([...total])) };
  }

  // What the server tells of a camera pixel under each other light, with the projector's name.
  numbersAt([y, x], split, signal) {
    return Promise.all(this.#lit.map(async ({ name, path, light }) => {
      const { sent: { values, shape }, colour } = light;
      const body = pack({ shape, colour, split, y, x }, values);
      return { name, ...await (await request(`${path}numbers`, { method: 'POST', body, signal })).json() };
    }));
  }
}
