// Undo and redo of everything that changes what the page shows: light, exposure, gains, view, the chosen camera pixel.

import { get, set } from './dom.js';

// Where the reader is on the page, and what lasts for a moment only.
const NOT_KEPT = ['theme', 'tab', 'map', 'blend'];
const MAXIMUM_STEPS = 300;
// Changes of the same values that follow each other so soon are one step.
const ONE_STEP_MILLISECONDS = 400;
const TEXT_FIELDS = ['text', 'search', 'number'];

const isPixel = value => Array.isArray(value) && typeof value[0] === 'number';
const isSame = (a, b) => a === b || isPixel(a) && isPixel(b) && String(a) === String(b);

export const isTyping = () => document.activeElement.isContentEditable || TEXT_FIELDS.includes(document.activeElement.type);

// What changes one state into another.
const between = (before, after) =>
  Object.fromEntries(Object.keys(after).filter(name => !NOT_KEPT.includes(name) && !isSame(before[name], after[name])).map(name => [name, after[name]]));

export class History {
  #store;
  #isPlaying;
  #onTravel;
  #past = [];
  #future = [];
  #isQuiet = false;
  // What one press of a pointer or of a key changes until it is let go is one step, as is what plays.
  #gesture = 0;
  #isHeld = false;
  #last = { gesture: -1, time: 0, names: '', isOfPlaying: false };

  // isPlaying(): whether the light moves by itself; onTravel(changes): a state of before is there again.
  constructor({ store, isPlaying, onTravel }) {
    this.#store = store;
    this.#isPlaying = isPlaying;
    this.#onTravel = onTravel;
    store.watch((before, after) => this.#changed(before, after));
    this.#followGestures();
    get('undo').onclick = () => this.undo();
    get('redo').onclick = () => this.redo();
    addEventListener('keydown', event => this.#onKey(event));
    this.#show();
  }

  undo() { this.#travel(this.#past, this.#future); }

  redo() { this.#travel(this.#future, this.#past); }

  // Does what is no step of its own.
  quietly(work) {
    this.#isQuiet = true;
    try { work(); } finally { this.#isQuiet = false; }
  }

  #followGestures() {
    const begins = isHeld => () => {
      this.#gesture += 1;
      this.#isHeld = isHeld;
      if (!this.#isPlaying()) this.#last.isOfPlaying = false;
    };
    addEventListener('pointerdown', begins(true), true);
    addEventListener('keydown', event => { if (!event.repeat) begins(false)(); }, true);
    for (const type of ['pointerup', 'pointercancel']) addEventListener(type, () => { this.#isHeld = false; });
  }

  #changed(before, after) {
    const names = Object.keys(between(before, after)).join();
    if (!names || this.#isQuiet) return;
    const { gesture, time, names: lastNames, isOfPlaying } = this.#last, now = performance.now();
    const isOfSame = names === lastNames, isPlaying = this.#isPlaying();
    const isSoon = isOfSame && now - time < ONE_STEP_MILLISECONDS;
    // The press that stops what plays begins while it still does.
    const playsOn = isOfSame && isOfPlaying && isPlaying;
    if (!playsOn && (gesture !== this.#gesture || !(this.#isHeld || isSoon || isPlaying))) {
      this.#past.push(before);
      if (this.#past.length > MAXIMUM_STEPS) this.#past.shift();
    }
    this.#future = [];
    this.#last = { gesture: this.#gesture, time: now, names, isOfPlaying: isPlaying };
    this.#show();
  }

  #travel(from, to) {
    const target = from.pop();
    if (!target) return;
    const changes = between(this.#store.state, target);
    to.push(this.#store.state);
    this.#last = { gesture: -1, time: 0, names: '', isOfPlaying: false };
    this.quietly(() => this.#store.update(changes));
    this.#onTravel(changes);
    this.#show();
  }

  #onKey(event) {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isTyping()) return;
    if (key === 'z' && !event.shiftKey) this.undo();
    else if (key === 'z' || key === 'y') this.redo();
    else return;
    event.preventDefault();
  }

  #show() {
    set(get('undo'), 'disabled', !this.#past.length);
    set(get('redo'), 'disabled', !this.#future.length);
  }
}
