// Maps of the whole camera picture, in false colour.

import { get, nearestPixel, positionOn, set, showingFaults } from './dom.js';
import { drawBarOf, drawFalseColour, markPixels, usualRange } from './false-colour.js';
import { requestMessage } from './protocol.js';

export class Maps {
  #scene;
  #store;
  #figures;
  #map = null;

  constructor({ scene, store, figures }) {
    this.#scene = scene;
    this.#store = store;
    this.#figures = figures;
    get('maps').append(new Option('choose a map', ''), ...scene.maps.map(({ name, title }) => new Option(title, name)));
    get('maps').onchange = () => this.show(get('maps').value);
    get('map').onpointermove = event => this.#showValue(event);
    figures.add(() => this.#draw());
  }

  show = showingFaults(async name => {
    this.#store.update({ map: name });
    this.#map = null;
    for (const id of ['map', 'map-bar', 'map-range']) get(id).hidden = true;
    get('map-scale').replaceChildren();
    for (const id of ['map-caption', 'map-value']) get(id).textContent = '';
    if (!name) return;
    get('map-caption').textContent = 'computing';
    const { header, arrays: [values, saturated] } = await requestMessage(`map/${name}`)
      .catch(error => {
        this.#store.update({ map: '' });
        get('map-caption').textContent = '';
        throw error;
      });
    if (this.#store.state.map !== name) return;
    this.#map = { ...values, ...header, name, saturated: saturated.data };
    for (const id of ['map', 'map-bar', 'map-range']) get(id).hidden = false;
    this.#draw();
  }, 'map');

  #draw() {
    if (!this.#map) return;
    const { data, shape, saturated, unit, name, low, high, title, reading } = this.#map, figures = this.#figures, map = figures.colourMap;
    figures.rename(get('map-range'), `map-${name}`);
    const range = figures.range(`map-${name}`, false, isLog => isLog ? usualRange(data, true) : { low, high });
    drawFalseColour(get('map'), data, shape, range, map);
    drawBarOf(get('map').closest('figure'), range, map, unit);
    const anySaturated = markPixels(get('map'), saturated, this.#scene.mark);
    get('map-caption').textContent = `${title}; ${map.none_name} where there is none` + (range.isLog ? ' above 0' : '') +
      (anySaturated ? ', red where saturated' : '') + '. ' + reading;
  }

  #showValue(event) {
    if (!this.#map) return;
    const { shape, data, saturated, unit } = this.#map, [y, x] = nearestPixel(positionOn(event, shape), shape);
    const place = y * shape[1] + x, value = data[place];
    set(get('map-value'), 'textContent', Number.isFinite(value) ? +value.toPrecision(4) + ' ' + unit : saturated[place] ? 'saturated' : 'none');
  }
}
