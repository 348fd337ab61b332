// The scene as the projector sees it, under a light on the camera's side that is dragged.

import { BackgroundJob } from './background.js';
import { all, get, nearestPixel, positionOn, set } from './dom.js';
import { Levels } from './levels.js';
import { ONE_PIXEL } from './painting.js';
import { drawPicture, exposureFor, pictureOf } from './picture.js';
import { pack, requestMessage } from './protocol.js';
import { shapeOf } from './shapes.js';
import { shareText } from './splits.js';
import { SPLITS, gainsOf } from './state.js';

// Of the splits, the model's alone can be sent back.
const SPLIT = 'model';
const KEYS = ['cameraLight', 'cameraX', 'cameraY', 'cameraRadius', 'split', 'solo', ...SPLITS[SPLIT]];
const SOFT = 0.3;
const CLICK_DISTANCE = 4;
// Larger pictures come coarsely while the light moves.
const SMALL_PIXELS = 2 ** 18;

const roundToQuarter = value => Math.round(4 * value) / 4;

export class Dual {
  #page;
  #job;
  #levels;
  // That the picture was asked for in.
  #split;

  constructor(page) {
    this.#page = page;
    this.#job = new BackgroundJob(text => set(get('tool-status'), 'textContent', text));
    this.#levels = new Levels(page.scene.camera, 1);
    document.querySelector('[data-of=cameraRadius]').max = Math.ceil(Math.min(...page.scene.camera) / 2);
    get('camera-pane').style.setProperty('--aspect', page.scene.camera[1] / page.scene.camera[0]);
    for (const button of all('[data-camera-light]'))
      button.onclick = () => page.store.update({ cameraLight: button.dataset.cameraLight });
    this.#bindPointer();
  }

  open() { this.#ask(); }

  close() { this.#job.cancel(); }

  frameArrived() { this.#draw(this.#page.store.state); }

  // Another split draws the light anew.
  lightChanged() { if (this.#page.store.state.split !== this.#split) this.#ask(); }

  changed(changes) { if (KEYS.some(name => name in changes)) this.#ask(); }

  label(state) {
    const share = state.split === SPLIT && shareText(this.#page.scene, state, SPLIT);
    return ['as the projector sees it, lit from the camera', share].filter(Boolean).join(', ');
  }

  show(state) {
    for (const button of all('[data-camera-light]')) set(button, 'ariaPressed', String(button.dataset.cameraLight === state.cameraLight));
    set(get('camera-radius'), 'hidden', state.cameraLight !== 'spot');
    this.#draw(state);
  }

  // Moves the light by rows and columns of the camera.
  move([down, right]) {
    const { store, scene: { camera } } = this.#page, { cameraX, cameraY } = store.state;
    const [y, x] = nearestPixel([cameraY + down, cameraX + right], camera);
    store.update({ cameraLight: 'spot', cameraY: y, cameraX: x });
  }

  #ask() {
    const { scene: { projector: [height, width] }, scenePictures, store } = this.#page;
    this.#split = store.state.split;
    scenePictures.isStageFinal = false;
    const isSmall = height * width <= SMALL_PIXELS;
    this.#job.ask((isSmall ? [false] : [true, false]).map(coarse => signal => this.#look(coarse, signal)));
  }

  async #look(coarse, signal) {
    const { scenePictures, store } = this.#page, { state } = store, [rows, columns] = this.#page.scene.camera;
    const isPixel = state.cameraLight === 'spot' && state.cameraRadius <= ONE_PIXEL;
    const spot = { kind: isPixel ? 'pixel' : state.cameraLight, x: state.cameraX, y: state.cameraY, radius: state.cameraRadius, soft: SOFT };
    this.#levels.fill(shapeOf(spot, rows, columns));
    const gains = state.split === SPLIT ? Object.fromEntries(gainsOf(state, SPLIT).map((gain, i) => [SPLITS[SPLIT][i], gain])) : {};
    const body = pack({ shape: this.#levels.shape, colour: [1, 1, 1], coarse, gains }, this.#levels.values);
    const { header, arrays: [found] } = await requestMessage('tool/dual', { method: 'POST', body, signal });
    // As bright as the relit scene, however many camera pixels there are for each of the projector.
    const picture = pictureOf(found, header.scale / header.brightness);
    scenePictures.replace(picture, !coarse && !KEYS.some(name => store.state[name] !== state[name]), store.state, { ofProjector: true });
  }

  // The relit scene, dark but where the light falls.
  #draw(state) {
    const canvas = get('camera-light'), { scene: { camera: [rows, columns] }, scenePictures } = this.#page;
    const relit = scenePictures.relit(state);
    if (!relit) return;
    drawPicture(canvas, relit, { exposure: exposureFor(relit), gamma: 1 });
    const pen = canvas.getContext('2d', { willReadFrequently: true });
    const across = canvas.width / columns, down = canvas.height / rows;
    pen.fillStyle = state.cameraLight === 'white' ? '#ffffffb0' : '#000000a0';
    pen.fillRect(0, 0, canvas.width, canvas.height);
    if (state.cameraLight === 'white') return;
    pen.fillStyle = '#ffffffd0';
    pen.beginPath();
    pen.ellipse((state.cameraX + 0.5) * across, (state.cameraY + 0.5) * down, Math.max(0.6, state.cameraRadius) * across,
      Math.max(0.6, state.cameraRadius) * down, 0, 0, 7);
    pen.fill();
  }

  // Drags the light; a click, which does not move it far, shows the camera pixel's row.
  #bindPointer() {
    const canvas = get('camera-light'), { scene: { camera }, store, inspector } = this.#page;
    let press = null;
    const place = event => {
      const [y, x] = positionOn(event, camera).map(roundToQuarter);
      store.update({ cameraLight: 'spot', cameraX: x, cameraY: y });
    };
    canvas.onpointerdown = event => {
      if (event.button || press) return;
      canvas.setPointerCapture(event.pointerId);
      press = { pointer: event.pointerId, at: [event.clientX, event.clientY] };
      place(event);
    };
    canvas.onpointermove = event => { if (press?.pointer === event.pointerId) place(event); };
    canvas.onpointerup = canvas.onpointercancel = event => {
      if (press?.pointer !== event.pointerId) return;
      const isClick = Math.hypot(event.clientX - press.at[0], event.clientY - press.at[1]) < CLICK_DISTANCE;
      press = null;
      if (isClick) inspector.showRow(...nearestPixel(positionOn(event, camera), camera));
    };
  }
}
