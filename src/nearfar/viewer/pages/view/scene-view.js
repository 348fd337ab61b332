// The scene enlarged and moved: which part of it is seen, and which colour.

import { all, get, set } from './dom.js';

const FARTHEST = 64;
const STEP = Math.SQRT2;
// Of what is seen.
const PAN_SHARE = 0.25;
const ARROWS = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };

// A middle near the border shows no more than the border.
const kept = (middle, zoom) => Math.min(1 - 0.5 / zoom, Math.max(0.5 / zoom, middle));

// Where a pointer is in a box, [down, across] from 0 to 1 within it.
const placeIn = (event, box) => [(event.clientY - box.top) / box.height, (event.clientX - box.left) / box.width];

export class SceneView {
  #store;
  #camera;
  #drag = null;

  constructor({ store, scene }) {
    this.#store = store;
    this.#camera = scene.camera;
    get('channels').hidden = scene.channels < 3;
    for (const button of all('[data-channel]')) button.onclick = () => store.update({ channel: button.dataset.channel });
    for (const button of all('[data-view]')) button.onclick = () => this.#press(button.dataset.view);
    this.#bindPointer(get('scene-view'));
    addEventListener('keydown', event => this.#onKey(event));
  }

  show({ viewZoom, viewX, viewY, channel }) {
    const size = `${100 * viewZoom}%`;
    for (const { style } of [get('stage'), get('second-stage')]) {
      set(style, 'width', size);
      set(style, 'height', size);
      set(style, 'left', `${100 * (0.5 - kept(viewX, viewZoom) * viewZoom)}%`);
      set(style, 'top', `${100 * (0.5 - kept(viewY, viewZoom) * viewZoom)}%`);
    }
    for (const button of all('[data-channel]')) set(button, 'ariaPressed', String(button.dataset.channel === channel));
    for (const button of all('[data-view]')) set(button, 'disabled', viewZoom === 1 && button.dataset.view !== 'in');
    set(get('view-zoom'), 'textContent', viewZoom === 1 ? 'whole scene' : `${+viewZoom.toFixed(1)}x`);
  }

  // Moves the view so far that a camera pixel is in it.
  follow([y, x]) {
    const { viewZoom, viewX, viewY } = this.#store.state, [height, width] = this.#camera, half = 0.5 / viewZoom;
    const within = (at, middle) => Math.abs(at - kept(middle, viewZoom)) <= half;
    const ax = (x + 0.5) / width, ay = (y + 0.5) / height;
    if (!within(ax, viewX) || !within(ay, viewY)) this.#store.update({ viewX: kept(ax, viewZoom), viewY: kept(ay, viewZoom) });
  }

  // Zooms about a point of the view, [down, across] from 0 to 1, which stays where it is.
  #zoom(factor, [down, across] = [0.5, 0.5]) {
    const { viewZoom, viewX, viewY } = this.#store.state, zoom = Math.min(FARTHEST, Math.max(1, viewZoom * factor));
    const middle = (before, share) => kept(kept(before, viewZoom) + (share - 0.5) * (1 / viewZoom - 1 / zoom), zoom);
    // Whole steps out and in again end at 1.
    this.#store.update({ viewZoom: Math.abs(zoom - Math.round(zoom)) < 1e-6 ? Math.round(zoom) : zoom, viewX: middle(viewX, across), viewY: middle(viewY, down) });
  }

  #pan(down, across) {
    const { viewZoom, viewX, viewY } = this.#store.state;
    this.#store.update({ viewX: kept(kept(viewX, viewZoom) + across / viewZoom, viewZoom), viewY: kept(kept(viewY, viewZoom) + down / viewZoom, viewZoom) });
  }

  #press(what) {
    if (what === 'in') this.#zoom(STEP);
    else if (what === 'out') this.#zoom(1 / STEP);
    else if (what === 'whole') this.#store.update({ viewZoom: 1, viewX: 0.5, viewY: 0.5 });
    else this.#pan(...ARROWS[what].map(step => PAN_SHARE * step));
  }

  // With Ctrl (a pinch has it, too) the wheel zooms; Shift or the middle button drags.
  #bindPointer(view) {
    // The picture that the pointer is on, of two that stand beside each other.
    const under = event => {
      const boxes = [...view.querySelectorAll('.part')].map(part => part.getBoundingClientRect());
      return boxes.findLast(box => event.clientX >= box.left) || boxes[0];
    };
    view.addEventListener('wheel', event => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.#zoom(2 ** (-event.deltaY / 200), placeIn(event, under(event)));
    }, { passive: false });
    view.addEventListener('pointerdown', event => {
      if (!event.shiftKey && event.button !== 1) return;
      event.preventDefault();
      event.stopPropagation();
      view.setPointerCapture(event.pointerId);
      const box = under(event);
      this.#drag = { box, at: placeIn(event, box) };
    }, true);
    view.addEventListener('pointermove', event => {
      if (!this.#drag) return;
      event.stopPropagation();
      const { box, at: [down, across] } = this.#drag, at = placeIn(event, box);
      this.#pan(down - at[0], across - at[1]);
      this.#drag = { box, at };
    }, true);
    for (const type of ['pointerup', 'pointercancel']) view.addEventListener(type, () => { this.#drag = null; }, true);
    // What was dragged was not clicked.
    view.addEventListener('click', event => { if (event.shiftKey) event.stopPropagation(); }, true);
  }

  #onKey(event) {
    if (document.activeElement !== get('picture') || event.altKey || event.metaKey) return;
    const arrow = event.ctrlKey && ARROWS[event.key], button = { '+': 'in', '=': 'in', '-': 'out', 0: 'whole' }[event.key];
    if (arrow) this.#pan(...arrow.map(step => PAN_SHARE * step));
    else if (button && !event.ctrlKey) this.#press(button);
    else return;
    event.preventDefault();
  }
}
