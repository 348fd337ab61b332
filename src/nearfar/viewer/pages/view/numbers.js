// Light under the pointer, or of the camera pixel that was chosen: of the whole and of its components, with sigma.

import { BackgroundJob } from './background.js';
import { get, nearestPixel, positionOn, set } from './dom.js';
import { HeldOut } from './held-out.js';
import { pack, request } from './protocol.js';
import { titleOf } from './splits.js';
import { SPLITS, hasPart } from './state.js';

const REST_MILLISECONDS = 150;
const CHANNELS = ['red', 'green', 'blue'];

const mean = values => values.reduce((sum, value) => sum + value, 0) / values.length;
export const valueText = value => {
  if (value === null) return 'unknown';
  return value === 0 ? '0' : Math.abs(value) < 0.001 ? value.toExponential(1) : value.toFixed(4);
};

const plusMinus = sigma => sigma ? ` ± ${valueText(sigma.includes(null) ? null : mean(sigma))}` : '';

// Of the sum of lights whose errors are independent, channel by channel; null where one is not known.
const sigmaOfSum = sigmas => sigmas.length && sigmas.every(Boolean)
  ? sigmas[0].map((_, c) => sigmas.some(each => each[c] === null) ? null : Math.hypot(...sigmas.map(each => each[c]))) : null;

export class Numbers {
  #page;
  #job = new BackgroundJob(text => this.#note(text === 'computing' ? '' : text));
  #pointed = null;
  #timer = 0;
  // What the server told, and of what.
  #told = { key: '', numbers: null };
  #lights = 0;
  #heldOut;

  constructor(page) {
    this.#page = page;
    this.#heldOut = new HeldOut({ scene: page.scene, onRead: () => this.refresh() });
    const canvas = get('picture');
    canvas.onpointermove = event => this.#point(nearestPixel(positionOn(event, this.#grid), this.#grid));
    canvas.onpointerleave = () => this.#point(null);
  }

  get #isDual() { return this.#page.store.state.tool === 'dual'; }

  get #grid() { return this.#isDual ? this.#page.scene.projector : this.#page.scene.camera; }

  lightChanged() {
    this.#lights += 1;
    this.refresh();
  }

  #point(place) {
    this.#pointed = place;
    this.refresh();
  }

  // Shows the numbers of the newest frame at once, and sigma once the server has told it.
  refresh() {
    const { store: { state }, scenePictures } = this.#page;
    const place = this.#pointed || (this.#isDual ? null : state.pixel), seen = place && scenePictures.valuesAt(place, this.#grid);
    if (!seen) { set(get('readout'), 'textContent', ''); return; }
    const key = [place, this.#lights, seen.split, ...seen.others.map(([name]) => name)].join();
    const told = this.#told.key === key ? this.#told.numbers : null;
    this.#showReadout(place, seen, told);
    if (this.#isDual) return;
    this.#showTable(place, seen, told);
    clearTimeout(this.#timer);
    if (!told) this.#timer = setTimeout(() => this.#job.ask([signal => this.#ask(place, seen.split, key, signal)]), REST_MILLISECONDS);
  }

  async #ask([y, x], split, key, signal) {
    const { light } = this.#page, { sent: { values, shape, block }, colour } = light;
    // A light of blocks moves, and has no sigma.
    if (block > 1) return;
    const body = pack({ shape, colour, split, y, x }, values);
    const own = request('numbers', { method: 'POST', body, signal }).then(answer => answer.json());
    const [numbers, others] = await Promise.all([own, this.#page.otherProjectors.numbersAt([y, x], split, signal)]);
    const ofOthers = Object.fromEntries(others.map(({ name, sigma }) => [name, sigma]));
    const lit = [...(this.#page.otherProjectors.isLit ? [numbers.sigma] : []), ...Object.values(ofOthers)];
    this.#told = { key, numbers: { ...numbers, ofOthers, ofSum: sigmaOfSum(lit) } };
    this.refresh();
  }

  #showReadout([y, x], { shown, parts, total, others, split, isRelit, textOf }, told) {
    const { scene, store: { state } } = this.#page;
    const sigma = isRelit ? plusMinus(told?.sigma) : '';
    const apart = isRelit ? SPLITS[split].filter(name => hasPart(scene, name)).map(name => `${titleOf(scene, name)} ${valueText(mean(parts[SPLITS[split].indexOf(name)]))}`) : [];
    const { scenePictures } = this.#page, beside = !this.#isDual && isRelit && scenePictures.referenceAt([y, x]);
    const heldOut = this.#isDual ? '' : this.#heldOut.at([y, x], scene.camera);
    const share = state.tool === 'reach' && !isRelit ? [`${(100 * mean(shown) / (mean(total) || 1)).toFixed(1)} % of its light, ${valueText(mean(total))}`] : [];
    const { projectors } = scene, isSeveral = isRelit && projectors.length > 0, own = isSeveral ? projectors.find(({ path }) => !path).name : '';
    const each = isSeveral ? [`${own} ${valueText(mean(total))}${sigma} (${apart.join(', ')})`, ...others.map(([name, values]) => `${name} ${valueText(mean(values))}${plusMinus(told?.ofOthers[name])}`)] : [];
    set(get('readout'), 'textContent', [`row ${y}, column ${x}: ${(textOf || valueText)(mean(shown))}${isSeveral ? plusMinus(told?.ofSum) : sigma}`, ...each, ...share, ...(isSeveral ? [] : apart),
      ...(beside ? [`${scenePictures.referenceName} ${valueText(mean(beside))}`] : []), ...(heldOut ? [`off at held-out photos ${heldOut}`] : [])].join(' · '));
  }

  #showTable([y, x], { parts, total, sum, others, split }, told) {
    const { scene } = this.#page, colours = total.length;
    set(get('numbers-pixel'), 'textContent', `row ${y}, column ${x}`);
    const names = SPLITS[split].filter(name => hasPart(scene, name));
    const rows = [['light', total, told?.sigma], ...names.map(name =>
      [titleOf(scene, name), parts[SPLITS[split].indexOf(name)], Object.values(told?.components || {})[names.indexOf(name)]?.sigma])];
    const head = ['', ...(colours === CHANNELS.length ? CHANNELS : ['light']), 'share'];
    get('numbers').replaceChildren(tableLine('th', head), ...rows.map(([title, values, sigma]) =>
      valuesLine(title, values, sigma, `${(100 * mean(values) / (mean(total) || 1)).toFixed(1)} %`)),
    ...this.#otherLines(sum, others, told), ...this.#heldOutLine([y, x], colours));
    get('numbers').hidden = false;
  }

  // Of several projectors: the light of the others, and of all that are lit.
  #otherLines(sum, others, told) {
    const ofSum = this.#page.scene.projectors.length ? [valuesLine('all that are lit', sum, told?.ofSum)] : [];
    return [...others.map(([name, values]) => valuesLine(name, values, told?.ofOthers[name])), ...ofSum];
  }

  #heldOutLine(place, colours) {
    const text = this.#heldOut.at(place, this.#page.scene.camera);
    return text ? [tableLine('td', ['off at held-out photos', ...Array(colours).fill(''), text])] : [];
  }

  #note(text) { if (text) set(get('numbers-note'), 'textContent', text); }
}

// A row of values with their standard deviations where these are known.
function valuesLine(title, values, sigma, share = '') {
  return tableLine('td', [title, ...values.map((value, c) => valueText(value) + (sigma ? `\n± ${valueText(sigma[c] ?? null)}` : '')), share]);
}

// A row of a table, whose first cell is its head.
export function tableLine(kind, texts) {
  const row = document.createElement('tr');
  row.append(...texts.map((textContent, i) => Object.assign(document.createElement(i ? kind : 'th'), { textContent })));
  return row;
}
