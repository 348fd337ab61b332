// The standard deviation of the relit picture at every camera pixel, in place of the picture.

import { BackgroundJob } from './background.js';
import { all, get, set } from './dom.js';
import { drawBarOf, drawFalseColour, usualRange } from './false-colour.js';
import { valueText } from './numbers.js';
import { pack, requestMessage } from './protocol.js';
import { SPLITS, gainsOf } from './state.js';

const PERCENT = 100;
const known = (value, text) => Number.isFinite(value) ? `± ${text}` : 'unknown';

// How it is shown, by its name in the state.
const SHOWN = {
  absolute: { figure: 'error-bars', unit: '', of: sigma => sigma, textOf: value => known(value, valueText(value)) },
  relative: { figure: 'error-bars-share', unit: '%', of: (sigma, light) => light > 0 ? PERCENT * sigma / light : NaN, textOf: value => known(value, `${value.toPrecision(2)} %`) },
};

export class ErrorBars {
  #page;
  #job;
  #found = null;
  #values = null;
  #shown = '';
  #asked = '';

  constructor(page) {
    this.#page = page;
    this.#job = new BackgroundJob(text => set(get('tool-status'), 'textContent', text));
    for (const button of all('[data-error-bars]')) button.onclick = () => page.store.update({ errorBars: button.dataset.errorBars });
    page.figures.add(() => { if (this.#values) page.scenePictures.draw(page.store.state); });
  }

  open() { this.#ask(); }

  close() {
    this.#job.cancel();
    this.#found = this.#values = null;
    this.#shown = this.#asked = '';
  }

  // A light of blocks moves: every pixel of it comes once it rests.
  lightChanged() { if (this.#page.light.sent.block === 1) this.#ask(); }

  label({ errorBars }) { return errorBars === 'relative' ? 'error bars of the relit picture, as a share of its light' : 'error bars of the relit picture'; }

  // Gains or the split may have changed, or how it is shown.
  show(state) {
    for (const button of all('[data-error-bars]')) set(button, 'ariaPressed', String(button.dataset.errorBars === state.errorBars));
    if (this.#asked && this.#asked !== this.#key()) this.#ask();
    if (this.#found && this.#shown !== state.errorBars) this.#put();
  }

  #key() {
    const { store: { state }, scenePictures: { split } } = this.#page;
    return [split, ...gainsOf(state, split)].join();
  }

  #ask() {
    this.#asked = this.#key();
    this.#page.scenePictures.isStageFinal = false;
    this.#job.ask([true, false].map(coarse => signal => this.#request(coarse, signal)));
  }

  async #request(coarse, signal) {
    const { light: { sent: { values, shape }, colour }, store: { state }, scenePictures: { split } } = this.#page;
    const given = gainsOf(state, split), gains = Object.fromEntries(SPLITS[split].map((name, i) => [name, given[i]]));
    // The physical split has no error bars of few camera pixels.
    if (coarse && split === 'physical') return;
    const body = pack({ shape, colour, split, gains, coarse }, values);
    const { arrays: [sigma, relit] } = await requestMessage('tool/error-bars', { method: 'POST', body, signal });
    this.#found = { sigma, relit, isFinal: !coarse };
    this.#put();
  }

  #put() {
    const { scenePictures, store: { state } } = this.#page, { sigma, relit, isFinal } = this.#found;
    const { of } = SHOWN[this.#shown = state.errorBars], [height, width] = sigma.shape;
    this.#values = sigma.data.map((value, i) => of(value, relit.data[i]));
    scenePictures.replace({ height, width, colours: 1, values: this.#values }, isFinal, state, {
      paint: canvas => this.#paint(canvas, sigma.shape), textOf: SHOWN[this.#shown].textOf,
    });
  }

  #paint(canvas, shape) {
    const { figures } = this.#page, { figure, unit } = SHOWN[this.#shown], map = figures.colourMap, place = get('error-bars-range');
    figures.rename(place, figure);
    const range = figures.range(figure, false, isLog => usualRange(this.#values, isLog));
    drawFalseColour(canvas, this.#values, shape, range, map);
    drawBarOf(get('error-bars-figure'), range, map, unit || 'photo units');
    set(get('error-bars-caption'), 'textContent', `One standard deviation, mean over channels; ${map.none_name} where it is not known` +
      (unit ? ' or there is no light' : '') + '.');
  }
}
