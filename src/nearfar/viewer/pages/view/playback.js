// Animation: what each kind of light does over time.

import { get } from './dom.js';

const SECONDS_ROUND_THE_CENTRE = 6;
const SECONDS_ACROSS = 5;
const DEGREES_OF_PHASE_A_SECOND = 120;
const PIXELS_A_SECOND = 8;
const SHIFTS_A_SECOND = 6;

export const canPlay = state =>
  !['white', 'paint'].includes(state.kind) && (state.kind !== 'picture' || state.pictures.length > 1);

const POSITIONS = {
  spot: (t, _state, { height, width }) => {
    const angle = 2 * Math.PI * t / SECONDS_ROUND_THE_CENTRE;
    return { x: (width - 1) / 2 * (1 + 0.7 * Math.cos(angle)), y: (height - 1) / 2 * (1 + 0.7 * Math.sin(angle)) };
  },
  stripe: (t, _state, { height, width }) => {
    const share = t / SECONDS_ACROSS % 1;
    return { x: share * width, y: share * height };
  },
  pixel: (t, _state, { height, width }) =>
    ({ x: Math.floor(PIXELS_A_SECOND * t) % width, y: Math.floor(PIXELS_A_SECOND * t / width) % height }),
  sinusoid: (t, _state, { firstPhase }) => ({ phase: Math.round(firstPhase + DEGREES_OF_PHASE_A_SECOND * t) % 360 }),
  checkerboard: (t, state) => ({ shift: Math.floor(SHIFTS_A_SECOND * t) % Math.max(1, 2 * state.side) }),
  picture: (t, _state, { pictureCount }) => ({ shown: pictureCount ? Math.floor(t) % pictureCount : 0 }),
};

export class Playback {
  #store;
  #light;
  // When it was started; 0 while it is stopped.
  #started = 0;

  constructor({ store, light }) {
    this.#store = store;
    this.#light = light;
  }

  get isPlaying() { return this.#started !== 0; }

  toggle() {
    if (!this.isPlaying && !canPlay(this.#store.state)) return;
    this.#started = this.isPlaying ? 0 : performance.now();
    get('play').ariaPressed = String(this.isPlaying);
    get('play').textContent = this.isPlaying ? 'stop' : 'animate';
    if (this.isPlaying) this.#run(this.#started, this.#store.state.phase);
  }

  #run(started, firstPhase) {
    const step = now => {
      if (this.#started !== started) return;
      const { state } = this.#store, { height, width } = this.#light, pictureCount = state.pictures.length;
      const changes = POSITIONS[state.kind]?.(Math.max(0, now - started) / 1000, state, { height, width, pictureCount, firstPhase });
      if (changes) this.#store.update(changes);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
