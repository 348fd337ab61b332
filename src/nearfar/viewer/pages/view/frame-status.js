// What the line below the scene says of frames: how fine they are, and how quickly they come.

import { get, set } from './dom.js';

const SECOND = 1000;

export class FrameStatus {
  #times = [];
  #timer = 0;

  // delay: seconds from the light before to its frame.
  arrived({ exact, stride, delay }) {
    const now = performance.now();
    this.#times = this.#times.filter(time => time > now - SECOND);
    this.#times.push(now);
    const detail = (exact ? '' : 'while it moves: ') + (stride > 1 ? `one row and column in ${stride}` : 'every camera pixel');
    this.#say(this.#times.length > 2 ? `${this.#times.length} pictures a second, ${Math.round(SECOND * delay)} ms after the light · ${detail}` : detail);
    // A rate is one of lights that move: it is gone once nothing comes.
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#say(detail), SECOND);
  }

  #say(text) { set(get('frame-status'), 'textContent', text); }
}

// For those who drive the page by a program; stage: whether what is shown in place of the relit scene is final, null for nothing.
export function describeFrame({ exact, split, isNewest }, count, stage) {
  document.body.dataset.frame = JSON.stringify({ count, exact, newest: isNewest, split, stage });
}
