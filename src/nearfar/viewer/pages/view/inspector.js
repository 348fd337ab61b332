// One camera pixel (a row of the transport), or one projector pixel (a column), as plots.

import { get, showingFaults } from './dom.js';
import { crop, drawLog, drawSpectrum } from './plots.js';
import { drawProfile } from './profile.js';
import { requestMessage } from './protocol.js';
import { hasPart } from './state.js';

export class Inspector {
  #scene;
  #store;
  #row = null;
  #request = null;
  #tabs;

  // tabs() gives the inspector's tabs.
  constructor({ scene, store, tabs }) {
    this.#tabs = tabs;
    this.#scene = scene;
    this.#store = store;
  }

  // With the tab that is open, in place of the row's.
  showRow = showingFaults(async (y, x, tab = '') => {
    this.#store.update({ pixel: [y, x] });
    const row = await this.#requestRow(y, x);
    if (!row) return;
    this.#row = row;
    get('row').hidden = false;
    if (!tab && this.#store.state.tab !== 'numbers') this.#tabs().open('row');
    this.drawRow();
  }, 'row');

  showColumn = showingFaults(async (y, x, tab = '') => {
    this.#store.update({ column: [y, x] });
    const { header, arrays: [values] } = await requestMessage(`column?y=${y}&x=${x}`);
    get('column-map').hidden = false;
    if (!tab) this.#tabs().offer('column');
    get('column').textContent = `row ${y}, column ${x}`;
    const { negative } = drawLog(get('column-map'), values.data, values.shape, this.#scene.scale);
    get('column-caption').textContent = 'photo units, log scale' + (header.stride > 1 ? `, one row and column in ${header.stride}` : '') + negativeText(negative);
  }, 'column');

  // No camera pixel is chosen any more.
  hideRow() {
    this.#row = null;
    get('row').hidden = true;
    get('pixel').textContent = 'click the scene';
  }

  // Draws the newest row, again when the page's colours or its width change.
  drawRow() {
    if (!this.#row) return;
    const { header, arrays: [near, far, nearError, farError, spectrum] } = this.#row;
    const { projector, scale } = this.#scene, [height, width] = projector;
    get('row').hidden = false;
    get('pixel').textContent = `row ${header.y}, column ${header.x}`;
    get('pixel-summary').textContent = summary(header);
    const around = crop(near.data, projector, header.q || [height / 2, width / 2], Math.floor(header.window / 2) + 1);
    drawLog(get('row-window'), around.values, around.shape, scale);
    const { negative } = drawLog(get('row-far'), far.data, projector, scale);
    get('row-negative').textContent = negativeText(negative);
    placeCross(header.q, projector);
    drawSpectrum(get('row-spectrum'), spectrum.data, projector, header, scale);
    const first = header.line * width;
    const line = (values, errors, colour) =>
      ({ values: values.data.slice(first, first + width), errors: errors.data, colour });
    const lines = [line(far, farError, '--far'), ...(hasPart(this.#scene, 'direct') ? [line(near, nearError, '--near')] : [])];
    drawProfile(get('row-profile'), lines, header.q ? header.q[1] : null);
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

// Of the sum of magnitudes.
const negativeText = share => share >= 0.001 ? `; ${(100 * share).toFixed(share < 0.1 ? 1 : 0)} % of it negative, in red` : '';

function placeCross(q, [height, width]) {
  get('row-q').hidden = !q;
  if (!q) return;
  get('row-q').style.top = `${100 * (q[0] + 0.5) / height}%`;
  get('row-q').style.left = `${100 * (q[1] + 0.5) / width}%`;
}

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
