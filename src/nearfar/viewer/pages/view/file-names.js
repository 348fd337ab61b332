// Names of files, which say what scene and what light they are of.

import { soloOf } from './state.js';

const short = value => String(+value.toFixed(1));
const at = s => `x${short(s.x)}-y${short(s.y)}`;
const count = (many, what) => `${many}-${what}${many === 1 ? '' : 's'}`;

const LIGHTS = {
  white: () => 'white',
  spot: s => `spot-${at(s)}-r${short(s.radius)}`,
  stripe: s => `stripe-${at(s)}-w${short(s.width)}-${short(s.angle)}deg`,
  sinusoid: s => `sinusoid-${short(s.cycles)}cycles-${short(s.angle)}deg-phase${short(s.phase)}`,
  checkerboard: s => `checkerboard-${short(s.side)}px-shift${short(s.shift)}`,
  paint: s => `paint-${count(s.strokes.length, 'stroke')}`,
  pixel: s => `pixel-x${Math.round(s.x)}-y${Math.round(s.y)}`,
  picture: s => `picture-${s.shown + 1}`,
};
// Those whose colour is their own, or none.
const UNTINTED = ['white', 'paint', 'picture'];

// A light in a few words, for files and for people.
export const lightName = state =>
  LIGHTS[state.kind](state) + (UNTINTED.includes(state.kind) || state.colour === '#ffffff' ? '' : state.colour.replace('#', '-'));

const plain = text => text.replace(/\.zarr$/iu, '').replace(/[^\p{L}\p{N}.]+/gu, '-').replace(/^[-.]+|[-.]+$/gu, '') || 'scene';

export const sceneName = scene => plain(scene.name);

// Of what is made of a scene and the page's light.
export const nameOf = ({ scene, store: { state } }) => `${plain(scene.name)}-${lightName(state)}`;

// Of the picture in the page: which components, which tool, which colour.
export function pictureName(page) {
  const { store: { state }, scenePictures } = page, solo = state.tool === 'relit' ? soloOf(state, scenePictures.split) : '';
  const what = { relit: 'relit', compensation: 'relit', reach: `${state.range}-${short(state.reach)}px`, dual: 'dual' }[state.tool];
  return [nameOf(page), solo ? `${solo}-only` : what, ...(state.channel ? [state.channel] : [])].join('-');
}
