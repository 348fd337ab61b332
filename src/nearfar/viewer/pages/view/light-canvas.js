// The light's own canvas: the light is drawn on it, and dragged or painted in it.

import { get, nearestPixel, positionOn } from './dom.js';
import { drawLight } from './picture.js';

const CLICK_DISTANCE = 4;
// Kinds that go where the pointer is.
const PLACED = ['spot', 'stripe', 'pixel'];

// A light that has not changed for so long is at rest.
const REST_MILLISECONDS = 120;

// Draws the light at most once for each frame of the screen, however often it changes; every pixel of it once it rests.
export class LightCanvas {
  #light;
  #store;
  #lamps;
  #onDrawn;
  #request = 0;
  #rest = 0;

  constructor({ light, store, lamps, onDrawn }) {
    this.#light = light;
    this.#store = store;
    this.#lamps = lamps;
    this.#onDrawn = onDrawn;
  }

  get isPending() { return this.#request !== 0; }

  draw() {
    this.#light.draw(this.#store.state);
    this.#show();
  }

  requestDraw() {
    clearTimeout(this.#rest);
    this.#request ||= requestAnimationFrame(() => {
      this.#request = 0;
      this.#light.drawMoving(this.#store.state);
      this.#show();
      this.#onDrawn();
      if (this.#light.sent.block > 1) this.#rest = setTimeout(() => this.drawAtRest(), REST_MILLISECONDS);
    });
  }

  // Draws every pixel now, if it is not drawn yet.
  drawAtRest() {
    clearTimeout(this.#rest);
    if (!this.isPending && this.#light.sent.block === 1) return;
    cancelAnimationFrame(this.#request);
    this.#request = 0;
    this.draw();
    this.#onDrawn();
  }

  #show() {
    const { shown, colour, changed } = this.#light;
    drawLight(get('light'), shown, colour, changed);
    this.#lamps.draw();
  }
}

// Enlarges the light within its pane, about the pane's middle.
export function zoomLight(zoom) {
  const canvas = get('light'), pane = get('pane'), width = `${100 * zoom}%`;
  if (canvas.style.width === width) return;
  const sides = () => [canvas.clientWidth, canvas.clientHeight], shown = [pane.clientWidth, pane.clientHeight];
  const middle = [pane.scrollLeft, pane.scrollTop].map((at, axis) => (at + shown[axis] / 2) / sides()[axis]);
  canvas.style.width = width;
  pane.scrollTo(...middle.map((share, axis) => share * sides()[axis] - shown[axis] / 2));
  // Where the screen has fewer pixels than the projector, none of a thin line's may be left out.
  canvas.style.imageRendering = canvas.clientWidth < canvas.width ? 'auto' : '';
}

const roundToQuarter = value => Math.round(4 * value) / 4;

// What a press of the pointer at [y, x] changes.
function pressed(state, [y, x]) {
  if (state.kind === 'paint')
    return { strokes: [...state.strokes, { colour: state.colour, radius: state.brush, points: [x, y] }] };
  return PLACED.includes(state.kind) ? { x, y } : null;
}

// What dragging changes, from where the pointer was pressed to [y, x]: the light is moved, or shifted.
function dragged(state, press, [y, x], projector) {
  if (PLACED.includes(state.kind)) return { x: roundToQuarter(x), y: roundToQuarter(y) };
  const dy = y - press.position[0], dx = x - press.position[1];
  if (state.kind === 'paint') return continuedStroke(state.strokes, [roundToQuarter(x), roundToQuarter(y)]);
  if (state.kind === 'checkerboard') return { shift: Math.max(0, Math.round(press.shift - dx)) };
  if (state.kind !== 'sinusoid') return null;
  const angle = state.angle * Math.PI / 180, distance = dx * Math.sin(angle) + dy * Math.cos(angle);
  const cycles = distance * state.cycles / Math.max(...projector);
  return { phase: ((Math.round(press.phase + 360 * cycles) % 360) + 360) % 360 };
}

function continuedStroke(strokes, [x, y]) {
  const stroke = strokes.at(-1);
  if (!stroke || stroke.points.at(-2) === x && stroke.points.at(-1) === y) return null;
  return { strokes: [...strokes.slice(0, -1), { ...stroke, points: [...stroke.points, x, y] }] };
}

// onPixel(y, x): a projector pixel was clicked.
export function bindPointer({ store, projector, onPixel }) {
  const canvas = get('light');
  let press = null;
  const update = changes => { if (changes) store.update(changes); };
  canvas.onpointerdown = event => {
    if (event.button || press) return;
    canvas.setPointerCapture(event.pointerId);
    const position = positionOn(event, projector), { phase, shift } = store.state;
    press = { pointer: event.pointerId, client: [event.clientX, event.clientY], position, phase, shift };
    update(pressed(store.state, position.map(roundToQuarter)));
  };
  canvas.onpointermove = event => {
    if (press?.pointer === event.pointerId) update(dragged(store.state, press, positionOn(event, projector), projector));
  };
  canvas.onpointercancel = event => { if (press?.pointer === event.pointerId) press = null; };
  canvas.onpointerup = event => {
    if (press?.pointer !== event.pointerId) return;
    const [x, y] = press.client, isClick = Math.hypot(event.clientX - x, event.clientY - y) < CLICK_DISTANCE;
    press = null;
    const { kind } = store.state;
    if (isClick && kind !== 'paint' || kind === 'pixel') onPixel(...nearestPixel(positionOn(event, projector), projector));
  };
}
