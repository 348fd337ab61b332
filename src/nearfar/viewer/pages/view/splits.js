// The two splits of a scene: their components, and the panel that shows those of one of them.

import { all, get, set } from './dom.js';
import { request } from './protocol.js';
import { SPLITS, canSplitPhysically, gainsOf, hasPart, isFree, soloOf } from './state.js';

// What each component is called, by the name of its gain.
const TITLES = {
  direct: 'direct', near: 'near-range', far: 'far-range', subsurface: 'subsurface', interreflection: 'inter-reflection',
};

export const titleOf = (scene, name) => name === 'far' && isFree(scene) ? 'lamp by lamp' : TITLES[name];

// What is shown of a split's components: '' for all of them as they are.
export function shareText(scene, state, split) {
  const solo = soloOf(state, split);
  if (solo) return `${titleOf(scene, solo)} light only`;
  const gains = gainsOf(state, split);
  return SPLITS[split].filter((_, i) => gains[i] !== 1).map(name => `${titleOf(scene, name)} × ${+state[name].toFixed(2)}`).join(', ');
}

// The physical split takes the server seconds, once: until then the model's is shown.
export class Splits {
  #scene;
  #store;
  #onReady;
  #isWaiting = false;
  // The split whose components the panel shows.
  #shown = '';

  constructor({ scene, store, onReady }) {
    Object.assign(this, { isPhysicalReady: false });
    this.#scene = scene;
    this.#store = store;
    this.#onReady = onReady;
    get('splits').hidden = !canSplitPhysically(scene);
    for (const button of all('[data-split]')) button.onclick = () => this.choose(button.dataset.split);
  }

  choose(split) {
    if (!canSplitPhysically(this.#scene)) return;
    this.#store.update({ split, solo: '' });
  }

  // The split that frames are to be of.
  get current() { return this.isPhysicalReady ? this.#store.state.split : 'model'; }

  // Asks for the physical split where the state wants it and it is not there yet.
  async prepare() {
    if (this.#store.state.split !== 'physical' || this.isPhysicalReady || this.#isWaiting) return;
    this.#isWaiting = true;
    this.#say('Splitting the transport physically. This takes some seconds, once; until then the model\'s split is shown.');
    try {
      const { bodies } = await (await request('split', { method: 'POST' })).json();
      this.isPhysicalReady = true;
      this.#say(bodies ? `${bodies} translucent ${bodies > 1 ? 'bodies' : 'body'} found.` : 'No translucent body was found: there is no subsurface light.');
      this.#onReady();
    } catch (error) {
      this.#say(error.message);
      this.#store.update({ split: 'model', solo: '' });
    } finally { this.#isWaiting = false; }
  }

  // The server was started again: the split is to be made again.
  lost() {
    this.isPhysicalReady = false;
    this.prepare();
  }

  #say(text) { set(get('split-status'), 'textContent', text); }

  // Names the components of the split that the frame has.
  show(split) {
    for (const button of all('[data-split]')) set(button, 'ariaPressed', String(button.dataset.split === this.#store.state.split));
    if (this.#shown === split) return;
    this.#shown = split;
    SPLITS[split].forEach((name, i) => {
      const canvas = get('part' + i), figure = canvas.parentElement, title = titleOf(this.#scene, name);
      const button = figure.querySelector('button'), input = figure.querySelector('input');
      figure.hidden = !hasPart(this.#scene, name);
      canvas.ariaLabel = `${title} light`;
      button.dataset.solo = name;
      button.textContent = title;
      input.dataset.of = name;
      input.ariaLabel = `gain of ${title} light`;
    });
  }
}
