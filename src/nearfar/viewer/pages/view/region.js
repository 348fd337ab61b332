// A region of the camera picture, dragged on the scene or typed: its mean row, spectrum, light and noise.

import { BackgroundJob } from './background.js';
import { get, nearestPixel, set } from './dom.js';
import { pack, requestMessage } from './protocol.js';
import { between, bindRegionDrag, readRegion } from './region-sides.js';
import { distanceText } from './reach.js';
import { showByDistance, showRegionNumbers } from './region-numbers.js';
import { drawRowPlots } from './row-plots.js';
import { markRegion } from './stage-marks.js';
import { isFree } from './state.js';

const SIDES = ['top', 'bottom', 'left', 'right'];
// A light that has not changed for so long is at rest.
const REST_MILLISECONDS = 150;
// Camera pixels about a chosen one, either way.
const REACH = 4;

export class Region {
  #page;
  #job = new BackgroundJob(text => set(get('region-status'), 'textContent', text));
  #found = null;
  #asked = '';
  #lights = 0;
  #timer = 0;

  constructor(page) {
    this.#page = page;
    this.#copyPlots();
    bindRegionDrag({ scene: page.scene, store: page.store, onMove: region => markRegion(region, page.scene.camera), onEnd: region => this.#choose(region) });
    for (const side of SIDES) get(`region-${side}`).onchange = () => this.#type();
    get('region-about').onclick = () => this.#choose(this.#aboutPixel());
    get('region-none').onclick = () => page.store.update({ region: null });
    page.figures.add(() => this.#draw());
  }

  lightChanged() {
    this.#lights += 1;
    this.show(this.#page.store.state);
  }

  // The picture by distance may be new.
  refresh() {
    const { store: { state }, scenePictures, scene } = this.#page, isByDistance = state.region && state.tool === 'reach';
    showByDistance(isByDistance ? scenePictures.shownAndTotal : null, state.region, scene.camera, distanceText(state));
  }

  show({ region, tab, tool }) {
    this.refresh();
    markRegion(tool === 'dual' ? null : region, this.#page.scene.camera);
    const { split } = this.#page.scenePictures, key = region ? [region, this.#lights, split].join() : '';
    set(get('region-none'), 'hidden', !region);
    if (tab !== 'region' || this.#asked === key) return;
    this.#asked = key;
    this.#fill(region);
    // A light of blocks moves: its numbers come once it rests.
    clearTimeout(this.#timer);
    if (region && this.#page.light.sent.block === 1)
      this.#timer = setTimeout(() => this.#job.ask([signal => this.#ask(region, split, signal)]), REST_MILLISECONDS);
    if (!region) this.#forget();
  }

  // The plots of a camera pixel's row, once more for that of the region.
  #copyPlots() {
    const plots = get('row').cloneNode(true);
    plots.id = 'region-plots';
    for (const element of plots.querySelectorAll('[id]')) element.id = element.id.replace('row-', 'region-');
    get('panel-region').append(plots, get('region-range'));
    if (!isFree(this.#page.scene)) {
      get('region-window-title').textContent = 'mean row: direct and near-range light about the middle of q';
      get('region-far-title').textContent = 'mean row: far-range light over the projector, middle of q at the cross';
    }
    get('region-errors').textContent = '';
    get('region-line').textContent = 'the mean row along the projector\'s row through the middle of q';
  }

  #choose(region) {
    this.#page.store.update({ region });
    this.#page.tabs.open('region');
  }

  #aboutPixel() {
    const { scene: { camera }, store: { state } } = this.#page;
    const [y, x] = state.pixel || camera.map(side => Math.floor(side / 2));
    return between(nearestPixel([y - REACH, x - REACH], camera), nearestPixel([y + REACH, x + REACH], camera));
  }

  #type() {
    const { scene: { camera }, store } = this.#page;
    const [top, bottom, left, right] = SIDES.map(side => get(`region-${side}`).value.trim() === '' ? NaN : Number(get(`region-${side}`).value));
    if ([top, bottom, left, right].some(Number.isNaN)) return;
    const region = readRegion([top, left, bottom + 1, right + 1], camera);
    set(get('region-status'), 'textContent', region ? '' :
      `Rows go from 0 to ${camera[0] - 1} and columns from 0 to ${camera[1] - 1}, the first before the last.`);
    if (region) store.update({ region });
  }

  #fill(region) {
    set(get('region-name'), 'textContent', region ? '' : 'drag over the scene, or type');
    if (!region) return;
    const [top, left, bottom, right] = region;
    [top, bottom - 1, left, right - 1].forEach((value, i) => set(get(`region-${SIDES[i]}`), 'value', String(value)));
  }

  #forget() {
    this.#job.cancel();
    this.#found = null;
    for (const id of ['region-numbers', 'region-plots', 'region-range']) get(id).hidden = true;
    for (const side of SIDES) get(`region-${side}`).value = '';
    get('region-note').textContent = '';
  }

  async #ask([top, left, bottom, right], split, signal) {
    const { light: { sent: { values, shape }, colour } } = this.#page;
    const body = pack({ shape, colour, split, top, left, bottom, right }, values);
    const { header, arrays: [near, far, spectrum] } = await requestMessage('tool/region', { method: 'POST', body, signal });
    this.#found = { header, near: near.data, far: far.data, spectrum: spectrum.data };
    for (const id of ['region-numbers', 'region-plots', 'region-range']) get(id).hidden = false;
    showRegionNumbers(header, this.#page.scene);
    this.#draw();
  }

  #draw() {
    if (!this.#found || get('panel-region').hidden) return;
    const { header, near, far, spectrum } = this.#found, none = new Float32Array(this.#page.scene.projector[1]);
    get('region-spectrum-title').textContent = 'spectrum, root mean square of ' +
      (header.spectrum_pixels > 1 ? `${header.spectrum_pixels} camera pixels' rows` : 'the row') + ', DC in the middle; dots: measured';
    drawRowPlots('region', { header, near, far, nearError: none, farError: none, spectrum }, this.#page);
  }
}
