// Lights between keyframes.

import { LIGHT_KEYS, pick } from './state.js';

// Kinds whose numbers go from those of one light to those of the next; others are cross-faded.
const MOVING = ['spot', 'stripe', 'sinusoid', 'checkerboard', 'pixel'];

const channels = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16));
const hexOf = values => '#' + values.map(value => Math.round(value).toString(16).padStart(2, '0')).join('');

function moved(from, to, share) {
  const mix = (a, b) => a + share * (b - a), colours = [from.colour, to.colour].map(channels);
  const numbers = LIGHT_KEYS.filter(name => typeof from[name] === 'number' && name !== 'shown');
  return {
    ...pick(from, LIGHT_KEYS), blend: null, colour: hexOf(colours[0].map((value, c) => mix(value, colours[1][c]))),
    ...Object.fromEntries(numbers.map(name => [name, mix(from[name], to[name])])),
  };
}

// The light, as a part of the state, at a time from 0 on; keyframes are `seconds` apart, and the last one stays.
export function lightAt(keyframes, seconds, time) {
  const place = Math.min(keyframes.length - 1, Math.max(0, time / seconds)), first = Math.floor(place), share = place - first;
  const from = keyframes[first], to = keyframes[first + 1];
  if (share === 0) return { ...from, blend: null };
  if (from.kind === to.kind && MOVING.includes(from.kind)) return moved(from, to, share);
  return { ...(share < 0.5 ? from : to), blend: { from, to, share } };
}

export const secondsOf = ({ keyframes, seconds }) => Math.max(0, keyframes.length - 1) * seconds;

// How many pictures a film has, the last keyframe among them.
export const pictureCountOf = state => Math.round(secondsOf(state) * state.rate) + 1;
