// Light by how far from q it comes, in projector pixels: within a reach, in a ring, or beyond it.

import { BackgroundJob } from './background.js';
import { all, get, set } from './dom.js';
import { pictureOf } from './picture.js';
import { pack, requestMessage } from './protocol.js';
import { Strip } from './strip.js';

const MAXIMUM_EDGES = 6;
const KEYS = ['range', 'reach', 'broad'];
const px = value => `${+value.toFixed(1)} px`;

export function distanceText({ range, reach, broad }) {
  if (range === 'within') return `light from less than ${px(reach)} away`;
  return range === 'beyond' ? `light from ${px(reach)} or more away` : `light from ${px(reach)} to ${px(reach + broad)} away`;
}

// Where rings end: 1, 2, 4 and so on, up to half of the projector.
function edgesOf([height, width]) {
  const most = Math.max(2, Math.max(height, width) / 2), factor = Math.max(2, most ** (1 / MAXIMUM_EDGES));
  const edges = [];
  for (let edge = 1; edge <= most * 1.001; edge *= factor) edges.push(Math.round(edge));
  return edges.slice(0, MAXIMUM_EDGES);
}

export class Reach {
  #page;
  #job;
  #strip = new Strip();
  #edges;
  #hasStrip = false;

  constructor(page) {
    this.#page = page;
    this.#job = new BackgroundJob(text => set(get('tool-status'), 'textContent', text));
    this.#edges = edgesOf(page.scene.projector);
    const side = Math.max(...page.scene.projector);
    document.querySelector('[data-of=reach]').max = side;
    document.querySelector('[data-of=broad]').max = Math.ceil(side / 2);
    for (const button of all('[data-range]')) button.onclick = () => page.store.update({ range: button.dataset.range });
  }

  open() { this.lightChanged(); }

  close() {
    this.#job.cancel();
    this.#strip.show([]);
  }

  lightChanged() {
    this.#hasStrip = false;
    // A light of blocks moves: every pixel of it comes once it rests.
    if (this.#page.light.sent.block === 1) this.#ask();
  }

  changed(changes) { if (KEYS.some(name => name in changes)) this.#ask(); }

  label(state) { return distanceText(state); }

  show(state) {
    for (const button of all('[data-range]')) set(button, 'ariaPressed', String(button.dataset.range === state.range));
    set(get('broad'), 'hidden', state.range !== 'ring');
    this.#strip.draw(state);
  }

  #ask() {
    this.#page.scenePictures.isStageFinal = false;
    const steps = [signal => this.#probe(true, signal), signal => this.#probe(false, signal)];
    if (!this.#hasStrip) steps.push(signal => this.#takeApart(signal));
    this.#job.ask(steps);
  }

  // What the server makes of the light.
  #request(path, more, signal) {
    const { sent: { values, shape }, colour } = this.#page.light;
    return requestMessage(`tool/${path}`, { method: 'POST', body: pack({ shape, colour, ...more }, values), signal });
  }

  async #probe(coarse, signal) {
    const { scenePictures, store } = this.#page, { range, reach, broad } = store.state;
    const inner = range === 'within' ? 0 : reach, outer = { within: reach, ring: reach + broad, beyond: null }[range];
    const { header, arrays: [found] } = await this.#request('reach', { inner, outer, coarse }, signal);
    scenePictures.replace(pictureOf(found, header.scale), !coarse, store.state);
  }

  async #takeApart(signal) {
    const { header, arrays: [{ shape, data }] } = await this.#request('distances', { edges: this.#edges }, signal);
    const [count, ...rest] = shape, length = data.length / count;
    this.#hasStrip = true;
    this.#strip.show(header.shares.map((share, i) => this.#item(i, share,
      pictureOf({ shape: rest, data: data.slice(i * length, (i + 1) * length) }, header.scale))));
    this.#strip.draw(this.#page.store.state);
  }

  #item(i, share, picture) {
    const inner = i ? this.#edges[i - 1] : 0, outer = this.#edges[i] || null;
    const chosen = !inner ? { range: 'within', reach: outer }
      : outer ? { range: 'ring', reach: inner, broad: outer - inner } : { range: 'beyond', reach: inner };
    return {
      picture, title: outer ? `${inner} to ${outer} px` : `${inner} px on`, detail: `${(100 * share).toFixed(1)} %`,
      isPressed: state => Object.keys(chosen).every(name => state[name] === chosen[name]),
      onClick: () => this.#page.store.update(chosen),
    };
  }
}
