// Keyframes: lights that the page plays through, from one to the next.

import { get, set } from './dom.js';
import { lightName } from './file-names.js';
import { lightAt, pictureCountOf, secondsOf } from './between-lights.js';
import { LIGHT_KEYS, pick } from './state.js';

const button = (textContent, ariaLabel, onclick, disabled = false) => Object.assign(document.createElement('button'), { textContent, ariaLabel, title: ariaLabel, onclick, disabled });

function filmText(state, isSum) {
  if (state.keyframes.length < 2) return 'Keep two lights or more, by “keep as keyframe” below the light. The page goes from one to the next.';
  const length = `${pictureCountOf(state)} pictures, ${+secondsOf(state).toFixed(1)} s`;
  if (isSum) return `${length}. Films are of one projector: let only the chosen one be lit to save one.`;
  if (state.tool !== 'relit') return `${length}. Films are of the relit scene: choose relit to save one.`;
  return length + (state.metering === 'auto' ? ', exposure follows the light' : '');
}

export class Keyframes {
  #store;
  #playback;
  #otherProjectors;
  // When it was started; 0 while it is stopped.
  #started = 0;
  #shown = null;

  constructor({ store, playback, tabs, otherProjectors }) {
    this.#otherProjectors = otherProjectors;
    this.#store = store;
    this.#playback = playback;
    get('add-keyframe').onclick = () => {
      this.#set([...store.state.keyframes, pick(store.state, LIGHT_KEYS)]);
      tabs.offer('keyframes');
    };
    get('play-keyframes').onclick = () => this.toggle();
  }

  get isPlaying() { return this.#started !== 0; }

  toggle() {
    const { state } = this.#store;
    if (!this.isPlaying && state.keyframes.length < 2) return;
    if (!this.isPlaying && this.#playback.isPlaying) this.#playback.toggle();
    this.#started = this.isPlaying ? 0 : performance.now();
    // A cross-fade ends at the keyframe that it is nearer to.
    if (!this.isPlaying && state.blend) this.#store.update({ blend: null });
    if (this.isPlaying) this.#run(this.#started);
    this.show(this.#store.state);
  }

  #run(started) {
    const step = now => {
      if (this.#started !== started) return;
      const { state } = this.#store;
      // Something else plays, or nothing is left to play.
      if (this.#playback.isPlaying || state.keyframes.length < 2) { this.toggle(); return; }
      const time = Math.max(0, now - started) / 1000;
      this.#store.update(lightAt(state.keyframes, state.seconds, time));
      if (time >= secondsOf(state)) this.toggle(); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  #set(keyframes) { this.#store.update({ keyframes }); }

  show(state) {
    const { keyframes } = state, isPlayable = keyframes.length > 1, { isSum } = this.#otherProjectors;
    set(get('play-keyframes'), 'textContent', this.isPlaying ? 'stop' : 'play keyframes');
    set(get('play-keyframes'), 'ariaPressed', String(this.isPlaying));
    set(get('play-keyframes'), 'disabled', !isPlayable);
    for (const id of ['film-pictures', 'film-mp4']) set(get(id), 'disabled', !isPlayable || isSum || state.tool !== 'relit');
    set(get('film-length'), 'textContent', filmText(state, isSum));
    if (this.#shown === keyframes) return;
    this.#shown = keyframes;
    get('keyframes').replaceChildren(...keyframes.map((frame, i) => this.#item(frame, i, keyframes)));
  }

  #item(frame, i, keyframes) {
    const item = document.createElement('li'), at = `keyframe ${i + 1}`, last = keyframes.length - 1;
    const exchange = (a, b) => () => this.#set(keyframes.map((other, n) => n === a ? keyframes[b] : n === b ? keyframes[a] : other));
    const show = button(lightName(frame).replaceAll('-', ' '), `show ${at}, ${lightName(frame).replaceAll('-', ' ')}`, () => this.#store.update({ ...frame, blend: null }));
    show.className = 'name';
    item.append(show, button('↑', `${at} earlier`, exchange(i, i - 1), i === 0), button('↓', `${at} later`, exchange(i, i + 1), i === last),
      button('✕', `remove ${at}`, () => this.#set(keyframes.filter((_, n) => n !== i))));
    return item;
  }
}
