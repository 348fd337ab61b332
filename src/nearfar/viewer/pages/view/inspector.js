// One camera pixel (a row of the transport), or one projector pixel (a column), as plots.

import { get, showingFaults } from './dom.js';
import { crop, drawLog, drawProfile, drawSpectrum } from './plots.js';
import { requestMessage } from './protocol.js';
import { hasPart, isFree } from './state.js';

export class Inspector {
  #scene;
  #store;
  #row = null;
  #request = null;

  constructor({ scene, store }) {
    this.#scene = scene;
    this.#store = store;
  }

  showRow = showingFaults(async (y, x) => {
    this.#store.update({ pixel: [y, x] });
    const row = await this.#requestRow(y, x);
    if (!row) return;
    this.#row = row;
    this.drawRow();
  });

  showColumn = showingFaults(async (y, x) => {
    this.#store.update({ column: [y, x] });
    const { header, arrays: [values] } = await requestMessage(`column?y=${y}&x=${x}`);
    get('column-map').hidden = false;
    get('column').textContent = `row ${y}, column ${x}`;
    const high = drawLog(get('column-map'), values.data, values.shape, this.#scene.scale);
    get('column-caption').textContent = `${(10 ** (high - 5)).toPrecision(2)} to ${(10 ** high).toPrecision(2)} photo units` +
      (header.stride > 1 ? `, one row and column in ${header.stride}` : '');
  });

  // Draws the newest row, again when the page's colours or its width change.
  drawRow() {
    if (!this.#row) return;
    const { header, arrays: [near, far, nearError, farError, spectrum] } = this.#row;
    const { projector, scale } = this.#scene, [height, width] = projector;
    get('row').hidden = false;
    get('pixel').textContent = `row ${header.y}, column ${header.x}`;
    get('pixel-summary').textContent = summary(header);
    const around = crop(near.data, projector, header.q || [height / 2, width / 2], Math.ceil(header.window / 2) + 1);
    drawLog(get('row-window'), around.values, around.shape, scale);
    drawLog(get('row-far'), far.data, projector, scale);
    drawSpectrum(get('row-spectrum'), spectrum.data, projector, header, scale);
    const first = header.line * width;
    const line = (values, errors, colour) =>
      ({ values: values.data.slice(first, first + width), errors: errors.data, colour });
    const lines = [line(far, farError, '--far'), ...(hasPart(this.#scene, 'direct') ? [line(near, nearError, '--near')] : [])];
    drawProfile(get('row-profile'), lines,
      `${isFree(this.#scene) ? `${lines.length > 1 ? 'orange: direct, ' : ''}green: each lamp` : 'orange: direct and near-range, green: far-range'}; projector column 0 to ${width - 1}`);
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

function summary({ q, floodlit, confidence, no_errors: noErrors, saturated }) {
  const parts = Object.keys(floodlit), total = parts.reduce((sum, name) => sum + floodlit[name], 0);
  const share = name => `${name} ${(100 * floodlit[name] / (total || 1)).toFixed(1)} %`;
  if (!('direct' in floodlit)) return `floodlit ${total.toPrecision(3)}` + (saturated ? '; a photo is saturated here' : '');
  return (q ? `q = (${q[0].toFixed(2)}, ${q[1].toFixed(2)})` : 'no direct light') +
    (confidence === null ? '' : `, confidence ${confidence.toFixed(2)}`) +
    `; floodlit ${total.toPrecision(3)}: ${parts.map(share).join(', ')}` +
    (noErrors && `; no error bars: ${noErrors}`) +
    (saturated ? '; saturated under white' : '');
}
