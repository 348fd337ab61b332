// The page's state, all that its address keeps: replaced by every change, never changed in place.

// Components by the split of the scene's light that they are of; each has a gain.
export const SPLITS = { model: ['direct', 'near', 'far'], physical: ['direct', 'subsurface', 'interreflection'] };
const GAINS = [...new Set(Object.values(SPLITS).flat())];
// Rows are free where there is neither a near nor a far range: they take the place of far-range light.
export const isFree = scene => scene.parts.includes('free');
// Whether a scene has a component.
export const hasPart = (scene, name) => scene.parts.includes(name) || name === 'far' && isFree(scene) ||
  canSplitPhysically(scene) && SPLITS.physical.includes(name);
export const canSplitPhysically = scene => scene.parts.includes('near');
export const ALL_ONE = Object.freeze(Object.fromEntries(GAINS.map(name => [name, 1])));
export const TOOLS = ['relit', 'reach', 'dual', 'compensation', 'error-bars'];
export const TABS = ['light', 'row', 'column', 'map', 'numbers', 'region', 'keyframes'];
export const ERROR_BARS = ['absolute', 'relative'];
export const ARRANGEMENTS = ['wipe', 'pair'];
export const RANGES = ['within', 'ring', 'beyond'];
export const CAMERA_LIGHTS = ['spot', 'white'];
export const CHANNELS = ['', 'red', 'green', 'blue'];
// Whether exposure stays as it is, or follows the light.
export const METERINGS = ['fixed', 'auto'];
export const KINDS = ['spot', 'stripe', 'sinusoid', 'checkerboard', 'white', 'paint', 'pixel', 'picture'];

// Which of several projectors the page is of.
export const numberOf = projectors => Math.max(0, projectors.findIndex(({ path }) => !path));

// What a page opens with; the keys are those of the address.
export function initialState({ projector: [height, width], camera: [rows, columns], beside, projectors }) {
  const side = Math.min(height, width);
  return Object.freeze({
    kind: 'spot', x: (width - 1) / 2, y: (height - 1) / 2, radius: Math.max(1, Math.round(side / 4)), soft: 0.5,
    angle: 90, width: Math.max(1, Math.round(side / 16)), cycles: 4, phase: 0, side: Math.max(1, Math.round(side / 16)),
    shift: 0, brush: Math.max(0.5, Math.round(side / 16)), shown: 0, zoom: 1, colour: '#ffffff', strokes: [], pictures: [],
    ...ALL_ONE, split: 'model', solo: '', exposure: 0, gamma: 1, wipe: 50, difference: false, map: '', pixel: null,
    column: null, theme: '', tab: 'light', tool: 'relit', range: 'beyond', reach: 3, broad: 3,
    colourMap: 'nearfar', ranges: {}, region: null, errorBars: 'absolute', arrangement: beside ? 'pair' : 'wipe',
    cameraLight: 'spot', cameraX: (columns - 1) / 2, cameraY: (rows - 1) / 2, cameraRadius: Math.max(1, Math.round(Math.min(rows, columns) / 8)),
    viewZoom: 1, viewX: 0.5, viewY: 0.5, channel: '', metering: 'fixed', keyframes: [], seconds: 2, rate: 25, blend: null,
    // Of several projectors: the lights of the others by their numbers, and the numbers of those that are lit.
    others: {}, lit: [numberOf(projectors)],
  });
}

const upTo = highest => [0, Math.max(1, highest)];

// How far numbers go, [lowest, highest].
export function limitsOf({ projector, camera }) {
  const side = Math.max(...projector), lens = Math.max(...camera);
  return {
    exposure: [-6, 12], gamma: [0.5, 3], wipe: [0, 100], reach: [0.5, side], broad: [0.5, Math.ceil(side / 2)], soft: [0, 1],
    angle: [0, 180], phase: [0, 360], x: [-side, 2 * side], y: [-side, 2 * side], cameraX: [-lens, 2 * lens], cameraY: [-lens, 2 * lens],
    radius: [0.5, Math.max(1, side / 2)], width: [1, side], side: [1, Math.max(1, side / 2)], cycles: upTo(side / 2), shift: upTo(side),
    brush: [0.5, Math.max(1, side / 4)], zoom: [1, Math.max(1, Math.ceil(side / 40))], cameraRadius: [0.5, Math.max(1, Math.ceil(Math.min(...camera) / 2))],
    viewZoom: [1, 64], viewX: [0, 1], viewY: [0, 1], seconds: [0.1, 20], rate: [1, 60], ...Object.fromEntries(GAINS.map(name => [name, [0, 4]])),
  };
}

// Everything else changes the light.
const DISPLAY_ONLY = [...GAINS, 'solo', 'exposure', 'gamma', 'wipe', 'difference', 'zoom', 'map', 'pixel', 'column', 'theme',
  'tab', 'tool', 'range', 'reach', 'broad', 'cameraLight', 'cameraX', 'cameraY', 'cameraRadius',
  'colourMap', 'ranges', 'region', 'errorBars', 'arrangement', 'viewZoom', 'viewX', 'viewY', 'channel', 'metering', 'keyframes', 'seconds', 'rate', 'others', 'lit'];

// What a light is drawn by.
export const LIGHT_KEYS = ['kind', 'x', 'y', 'radius', 'soft', 'angle', 'width', 'cycles', 'phase', 'side', 'shift', 'shown', 'colour', 'strokes'];
export const pick = (state, names) => Object.fromEntries(names.map(name => [name, state[name]]));

export const changesLight = changes => Object.keys(changes).some(name => !DISPLAY_ONLY.includes(name));

// The component of a split that is shown alone; '' for all of them.
export const soloOf = (state, split) => SPLITS[split].includes(state.solo) ? state.solo : '';

// Gains of a split's components, as they are shown: one alone, or all.
export const gainsOf = (state, split) => SPLITS[split].map(name => (soloOf(state, split) || name) === name ? state[name] : 0);

export class Store {
  #state;
  #onChange;
  #watch = () => {};

  // onChange(changes) is called after each change.
  constructor(state, onChange) {
    this.#state = Object.freeze(state);
    this.#onChange = onChange;
  }

  get state() { return this.#state; }

  // watch(before, after) is called at each change, too.
  watch(watch) { this.#watch = watch; }

  update(changes) {
    const before = this.#state;
    // A light that is changed is no longer one between two keyframes.
    const all = before.blend && changesLight(changes) ? { blend: null, ...changes } : changes;
    this.#state = Object.freeze({ ...before, ...all });
    this.#watch(before, this.#state);
    this.#onChange(all);
  }
}
