// One camera pixel (a row of the transport), or one projector pixel (a column), as plots.

import { get, showingFaults } from './dom.js';
import { drawSigned, negativeText } from './plots.js';
import { requestMessage } from './protocol.js';
import { drawRowPlots } from './row-plots.js';

export class Inspector {
  #scene;
  #store;
  #row = null;
  #column = null;
  #request = null;
  #tabs;
  #figures;

  // tabs() gives the inspector's tabs.
  constructor({ scene, store, tabs, figures }) {
    this.#tabs = tabs;
    this.#scene = scene;
    this.#store = store;
    this.#figures = figures;
    figures.add(() => { this.#drawRow(); this.#drawColumn(); });
  }

  // With the tab that is open, in place of the row's.
  showRow = showingFaults(async (y, x, tab = '') => {
    this.#store.update({ pixel: [y, x] });
    const row = await this.#requestRow(y, x);
    if (!row) return;
    this.#row = row;
    get('row').hidden = false;
    if (!tab && this.#store.state.tab !== 'numbers') this.#tabs().open('row');
    this.#drawRow();
  }, 'row');

  showColumn = showingFaults(async (y, x, tab = '') => {
    this.#store.update({ column: [y, x] });
    this.#column = await requestMessage(`column?y=${y}&x=${x}`);
    for (const id of ['column-map', 'column-range']) get(id).hidden = false;
    if (!tab) this.#tabs().offer('column');
    get('column').textContent = `row ${y}, column ${x}`;
    this.#drawColumn();
  }, 'column');

  // No camera pixel is chosen any more.
  hideRow() {
    this.#row = null;
    for (const id of ['row', 'row-ranges']) get(id).hidden = true;
    get('pixel').textContent = 'click the scene';
  }

  #drawColumn() {
    if (!this.#column) return;
    const { header: { stride }, arrays: [{ data, shape }] } = this.#column, figures = this.#figures;
    const negative = drawSigned(get('column-map'), data, shape, figures, 'column');
    get('column-caption').textContent = 'photo units' + (stride > 1 ? `, one row and column in ${stride}` : '') + negativeText(negative, figures.colourMap);
  }

  #drawRow() {
    get('row-ranges').hidden = !this.#row;
    if (!this.#row) return;
    const { header, arrays: [near, far, nearError, farError, spectrum] } = this.#row;
    get('row').hidden = false;
    get('pixel').textContent = `row ${header.y}, column ${header.x}`;
    get('pixel-summary').textContent = summary(header);
    const [nearData, farData, nearErrors, farErrors, spectrumData] = [near, far, nearError, farError, spectrum].map(({ data }) => data);
    drawRowPlots('row', { header, near: nearData, far: farData, nearError: nearErrors, farError: farErrors, spectrum: spectrumData },
      { scene: this.#scene, figures: this.#figures });
  }

  // The row, or null if another one was asked for in the meantime.
  async #requestRow(y, x) {
    this.#request?.abort();
    const controller = this.#request = new AbortController();
    try {
      const row = await requestMessage(`row?y=${y}&x=${x}`, { signal: controller.signal });
      return controller.signal.aborted ? null : row;
    } catch (error) {
      if (controller.signal.aborted) return null;
      throw error;
    }
  }
}

const RANGES = { near: 'near-range', far: 'far-range' };

function summary({ q, floodlit, confidence, no_errors: noErrors, saturated }) {
  const parts = Object.keys(floodlit), total = parts.reduce((sum, name) => sum + floodlit[name], 0);
  const share = name => `${RANGES[name] || name} ${(100 * floodlit[name] / (total || 1)).toFixed(1)} %`;
  if (!('direct' in floodlit)) return `floodlit ${total.toPrecision(3)}` + (saturated ? '; a photo is saturated here' : '');
  return (q ? `q = (${q[0].toFixed(2)}, ${q[1].toFixed(2)})` : 'no direct light') +
    (confidence === null ? '' : `, confidence ${confidence.toFixed(2)}`) +
    `; floodlit ${total.toPrecision(3)}: ${parts.map(share).join(', ')}` +
    (noErrors && `; no error bars: ${noErrors}`) +
    (saturated ? '; saturated under white' : '');
}
