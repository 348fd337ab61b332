// The page's state in its address: only what differs from the initial state.

import { PHOTO_URL } from './photo-series.js';
import { readRanges } from './ranges.js';
import { readRegion } from './region-sides.js';
import { ARRANGEMENTS, CAMERA_LIGHTS, CHANNELS, ERROR_BARS, KINDS, LIGHT_KEYS, METERINGS, RANGES, SPLITS, TABS, TOOLS, limitsOf, pick } from './state.js';

// Dropped pictures that take more than this are left out of the address.
const MAXIMUM_PICTURE_CHARACTERS = 400000;
const MAXIMUM_STROKES = 2000;
const MAXIMUM_PICTURES = 100;
const MAXIMUM_KEYFRAMES = 100;
const SAVING_DELAY_MILLISECONDS = 250;
const COLOUR = /^#[0-9a-f]{6}$/i;
const PNG_URL = /^data:image\/png;base64,[A-Za-z0-9+/]+=*$/;

const urlsOf = ({ pictures, ...state }) => ({ ...state, pictures: pictures.map(({ url }) => url), blend: null });

// What a state has that the initial one has not, for JSON.
export function changesOf(given, initial) {
  const changed = {}, state = urlsOf(given);
  for (const name of Object.keys(initial))
    if (JSON.stringify(state[name]) !== JSON.stringify(initial[name])) changed[name] = state[name];
  // Empty entries keep the index of the other pictures.
  if (changed.pictures && JSON.stringify(changed.pictures).length > MAXIMUM_PICTURE_CHARACTERS)
    changed.pictures = changed.pictures.map(() => '');
  return changed;
}

export function toAddress(state, initial) {
  const changed = changesOf(state, initial);
  return Object.keys(changed).length ? '#' + encodeURIComponent(JSON.stringify(changed)) : '#';
}

export function fromAddress(hash, initial, scene) {
  let given = {};
  try { given = JSON.parse(decodeURIComponent(hash.slice(1))) || {}; } catch { return { ...initial }; }
  return stateOf(given, initial, scene);
}

// Anyone may have written the address: values of the wrong type are left out, and none goes further than its slider. Pictures are
// URLs still.
export function stateOf(given, initial, scene) {
  const state = { ...initial };
  for (const [name, before] of Object.entries(initial)) {
    const value = given[name];
    if (value === undefined) continue;
    if (typeof before === 'number' && Number.isFinite(value)) state[name] = value;
    if (typeof before === 'string' && typeof value === 'string') state[name] = value;
  }
  for (const [name, [low, high]] of Object.entries(limitsOf(scene))) state[name] = Math.min(high, Math.max(low, state[name]));
  if (!COLOUR.test(state.colour)) state.colour = initial.colour;
  for (const [name, known] of [['kind', KINDS], ['tool', TOOLS], ['range', RANGES], ['cameraLight', CAMERA_LIGHTS], ['tab', TABS],
    ['errorBars', ERROR_BARS], ['arrangement', ARRANGEMENTS], ['channel', CHANNELS], ['metering', METERINGS]])
    if (!known.includes(state[name])) state[name] = initial[name];
  if (!Object.hasOwn(SPLITS, state.split)) state.split = initial.split;
  for (const name of ['pixel', 'column'])
    if (Array.isArray(given[name]) && given[name].length === 2 && given[name].every(Number.isInteger))
      state[name] = given[name];
  state.difference = given.difference === true;
  Object.assign(state, { ranges: readRanges(given.ranges), region: readRegion(given.region, scene.camera) });
  // Each is read once its projector is known.
  if (given.others && typeof given.others === 'object') state.others = { ...given.others };
  if (Array.isArray(given.lit)) state.lit = given.lit.filter(number => Number.isInteger(number) && number in scene.projectors);
  if (Array.isArray(given.strokes)) state.strokes = given.strokes.filter(isStroke).slice(0, MAXIMUM_STROKES);
  if (Array.isArray(given.keyframes))
    state.keyframes = given.keyframes.slice(0, MAXIMUM_KEYFRAMES).map(frame => pick(stateOf({ ...frame, keyframes: [] }, initial, scene), LIGHT_KEYS));
  if (Array.isArray(given.pictures))
    state.pictures = given.pictures.slice(0, MAXIMUM_PICTURES).map(url => typeof url === 'string' && (PNG_URL.test(url) || PHOTO_URL.test(url)) ? url : '');
  return state;
}

const isStroke = stroke => stroke && COLOUR.test(stroke.colour) && stroke.radius >= 0.5 && stroke.radius < 10000 &&
  Array.isArray(stroke.points) && stroke.points.length > 1 && stroke.points.length % 2 === 0 &&
  stroke.points.every(value => Number.isFinite(value) && Math.abs(value) < 20000);

// A function that writes a state to the address once no newer one has followed for a while.
export function createAddressWriter(initial) {
  let timer = 0;
  return state => {
    clearTimeout(timer);
    timer = setTimeout(() => history.replaceState(null, '', toAddress(state, initial)), SAVING_DELAY_MILLISECONDS);
  };
}
