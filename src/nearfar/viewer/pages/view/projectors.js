// Which of several projectors the light is of, and which are lit.

import { changesOf } from './address.js';
import { get, set } from './dom.js';
import { LIGHT_KEYS, numberOf, pick } from './state.js';

// What belongs to one projector; the rest goes along to the page of another one, but for what names places of a projector.
const OF_A_PROJECTOR = [...LIGHT_KEYS, 'pictures', 'keyframes', 'seconds', 'rate', 'zoom'];
const OF_A_PAGE = ['column', 'ranges', 'tool', 'map', 'others', 'lit'];

const present = (changes, names) => pick(changes, names.filter(name => name in changes));

// The address of another projector's page, with the lights of all and the look of this one.
export function addressOf(target, { projectors }, state, initial) {
  const changes = changesOf(state, initial), here = numberOf(projectors);
  const { [target]: given = {}, ...others } = { ...state.others, [here]: present(changes, OF_A_PROJECTOR) };
  const shared = Object.keys(changes).filter(name => ![...OF_A_PROJECTOR, ...OF_A_PAGE].includes(name));
  const next = { ...given, ...present(changes, shared), others, lit: [...new Set([...state.lit, target])].toSorted((a, b) => a - b) };
  return `${projectors[target].path}#${encodeURIComponent(JSON.stringify(next))}`;
}

export class Projectors {
  #store;
  #boxes = [];
  #here;
  #otherProjectors;

  constructor({ scene, store, initial, otherProjectors }) {
    Object.assign(this, { initial });
    this.#store = store;
    this.#here = numberOf(scene.projectors);
    this.#otherProjectors = otherProjectors;
    get('projectors').hidden = !scene.projectors.length;
    get('projector-list').replaceChildren(...scene.projectors.map(({ name }, number) => this.#item(name, number, scene)));
  }

  #item(name, number, scene) {
    const item = document.createElement('li'), button = document.createElement('button'), label = document.createElement('label');
    const box = Object.assign(document.createElement('input'), { type: 'checkbox', ariaLabel: `${name} is lit` });
    Object.assign(button, { textContent: name, ariaPressed: String(number === this.#here), title: `choose the light of ${name}` });
    button.onclick = () => { if (number !== this.#here) location.assign(addressOf(number, scene, this.#store.state, this.initial)); };
    box.onchange = () => this.#store.update({ lit: box.checked ? [...this.#store.state.lit, number].toSorted((a, b) => a - b) : this.#store.state.lit.filter(other => other !== number) });
    label.append(box, ' lit');
    item.append(button, label);
    this.#boxes.push(box);
    return item;
  }

  show({ lit }) {
    this.#boxes.forEach((box, number) => set(box, 'checked', lit.includes(number)));
    if (!this.#boxes.length) return;
    // It is of this projector's light alone, which would not be what is shown.
    const { isSum } = this.#otherProjectors;
    set(get('save-exr'), 'disabled', isSum);
    set(get('save-exr'), 'title', isSum ? 'of one projector alone: let only the chosen one be lit' : '');
  }
}
