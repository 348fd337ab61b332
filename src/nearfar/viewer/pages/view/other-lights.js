// Lights of the other projectors before the same camera, as the address has them.

import { stateOf } from './address.js';
import { restorePictures } from './files.js';
import { Light } from './light.js';
import { request } from './protocol.js';
import { initialState, numberOf } from './state.js';

// The others of a scene, with the lights that the address gives them; how many of their pictures it does not hold.
export async function loadOthers({ projectors }, given) {
  const here = numberOf(projectors), links = projectors.map((link, number) => ({ ...link, number })).filter(({ number }) => number !== here);
  return Promise.all(links.map(async link => {
    const scene = await (await request(`${link.path}scene`)).json();
    const state = stateOf(given[link.number] || {}, initialState(scene), scene), light = new Light(scene.projector);
    const { pictures, missing } = await restorePictures(state.pictures, light, link.path);
    Object.assign(state, { pictures, shown: Math.max(0, Math.min(Math.round(state.shown), pictures.length - 1)) });
    light.draw(state);
    return { ...link, scene, state, light, missing };
  }));
}
