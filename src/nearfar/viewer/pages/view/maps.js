// Maps of the whole camera picture, in false colour.

import { get, nearestPixel, positionOn, showingFaults } from './dom.js';
import { drawMap, gradient, markPixels } from './plots.js';
import { requestMessage } from './protocol.js';

export class Maps {
  #scene;
  #store;
  #map = null;

  constructor({ scene, store }) {
    this.#scene = scene;
    this.#store = store;
    get('maps').append(new Option('choose a map', ''), ...scene.maps.map(({ name, title }) => new Option(title, name)));
    get('map-bar').style.background = gradient(scene.scale);
    get('maps').onchange = () => this.show(get('maps').value);
    get('map').onpointermove = event => this.#showValue(event);
  }

  show = showingFaults(async name => {
    this.#store.update({ map: name });
    for (const id of ['map', 'map-bar']) get(id).hidden = !name;
    for (const id of ['map-low', 'map-high', 'map-caption', 'map-value']) get(id).textContent = '';
    if (!name) return;
    get('map-caption').textContent = 'computing';
    const { header, arrays: [values, saturated] } = await requestMessage(`map/${name}`)
      .catch(error => {
        this.#store.update({ map: '' });
        for (const id of ['map', 'map-bar']) get(id).hidden = true;
        get('map-caption').textContent = '';
        throw error;
      });
    if (this.#store.state.map !== name) return;
    this.#map = { ...values, saturated: saturated.data, unit: header.unit };
    drawMap(get('map'), values.data, values.shape, header.low, header.high, this.#scene.scale);
    const anySaturated = markPixels(get('map'), saturated.data, this.#scene.mark);
    const unit = header.unit && ' ' + header.unit;
    get('map-low').textContent = +header.low.toPrecision(3) + unit;
    get('map-high').textContent = +header.high.toPrecision(3) + unit;
    get('map-caption').textContent = header.title + '; grey where there is none' +
      (anySaturated ? ', red where saturated' : '') + '. ' + header.reading;
  }, 'map');

  #showValue(event) {
    if (!this.#map) return;
    const { shape, data, saturated, unit } = this.#map, [y, x] = nearestPixel(positionOn(event, shape), shape);
    const place = y * shape[1] + x, value = data[place];
    get('map-value').textContent = Number.isFinite(value) ? +value.toPrecision(4) + ' ' + unit
      : saturated[place] ? 'saturated' : 'none';
  }
}
