// What figures in false colour share: the colour map, and the range of each, automatic or typed.

import { all, set } from './dom.js';
import { buildFields } from './range-fields.js';
import { faultOf, resolve, withoutUndefined } from './ranges.js';

export class Figures {
  #store;
  #maps;
  #draws = [];
  #shown = '';

  constructor({ scene, store }) {
    this.#store = store;
    this.#maps = scene.colour_maps;
    for (const place of all('[data-range-of]')) this.#build(place);
    document.addEventListener('keydown', event => {
      // What is typed into a field is no key of the page.
      if (event.target.matches?.('.typed input')) event.stopPropagation();
    });
  }

  get colourMap() { return this.#maps.find(({ name }) => name === this.#store.state.colourMap) || this.#maps[0]; }

  // The range of a figure. automatic(isLog) gives the ends that suit what it shows.
  range(name, isLogByItself, automatic) {
    const typed = this.#store.state.ranges[name] || {}, isLog = typed.isLog ?? isLogByItself;
    return resolve({ ...typed, isLog }, automatic(isLog));
  }

  // draw() is called when colours or ranges have changed, and by `draw`.
  add(draw) { this.#draws.push(draw); }

  draw() { this.#draws.forEach(draw => draw()); }

  // Shows the state in the controls; draws all figures again if it concerns them.
  show({ colourMap, ranges }) {
    const shown = JSON.stringify([colourMap, ranges]);
    if (this.#shown === shown) return;
    const isFirst = !this.#shown;
    this.#shown = shown;
    for (const place of all('[data-range-of]')) this.#fill(place);
    if (!isFirst) this.draw();
  }

  // A figure whose name changes, as that of the map which is shown.
  rename(place, name) {
    if (place.dataset.rangeOf === name) return;
    place.dataset.rangeOf = name;
    this.#fill(place);
  }

  #build(place) {
    const { fields, button } = buildFields(place, this.#maps);
    for (const [end, input] of fields.ends) input.onchange = () => this.#type(place, end, input);
    if (fields.scale) fields.scale.onchange = () => this.#update(place, { isLog: fields.scale.value === 'true' });
    if (fields.colours) fields.colours.onchange = () => this.#store.update({ colourMap: fields.colours.value });
    button.onclick = () => this.#update(place, null);
  }

  #fill(place) {
    const { ranges } = this.#store.state, typed = ranges[place.dataset.rangeOf] || {};
    for (const input of place.querySelectorAll('input')) set(input, 'value', typed[input.dataset.end] === undefined ? '' : String(typed[input.dataset.end]));
    const scale = place.querySelector('[data-scale]'), colours = place.querySelector('[data-colours]');
    if (scale) set(scale, 'value', String(typed.isLog ?? scale.dataset.scale === 'true'));
    if (colours) set(colours, 'value', this.colourMap.name);
    for (const input of place.querySelectorAll('input')) set(input, 'ariaInvalid', 'false');
    this.#say(place, '');
  }

  #type(place, end, input) {
    const text = input.value.trim().replace(',', '.'), value = text === '' ? undefined : Number(text);
    const fault = this.#faultOf(place, { [end]: value });
    input.ariaInvalid = String(Boolean(fault));
    this.#say(place, fault);
    if (!fault) this.#update(place, { [end]: value });
  }

  #faultOf(place, changed) {
    const scale = place.querySelector('[data-scale]'), typed = { isLog: scale?.value === 'true', ...this.#store.state.ranges[place.dataset.rangeOf], ...changed };
    return faultOf(typed, place.dataset.isSymmetric !== undefined);
  }

  // Changes the range that is typed for a figure; null for an automatic one.
  #update(place, changes) {
    const { [place.dataset.rangeOf]: before, ...others } = this.#store.state.ranges;
    const range = withoutUndefined({ ...before, ...changes });
    const fault = changes && this.#faultOf(place, changes);
    // A scale that what was typed does not suit makes the ends automatic.
    const kept = fault ? withoutUndefined(changes) : range;
    this.#store.update({ ranges: changes && Object.keys(kept).length ? { ...others, [place.dataset.rangeOf]: kept } : others });
    if (!changes) this.#fill(place);
  }

  #say(place, text) { set(place.querySelector('[role=status]'), 'textContent', text); }
}
