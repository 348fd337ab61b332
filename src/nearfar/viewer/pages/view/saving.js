// Pictures and lights as files.

import { get, showingFaults } from './dom.js';
import { nameOf, pictureName } from './file-names.js';
import { pack, request } from './protocol.js';
import { SPLITS, gainsOf } from './state.js';

const PATIENCE_MILLISECONDS = 60000;
const POLLING_MILLISECONDS = 50;
const REVOKING_DELAY_MILLISECONDS = 10000;

export function download(blob, name) {
  const anchor = document.createElement('a');
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), REVOKING_DELAY_MILLISECONDS);
}

// Saves the canvas as it is displayed, once it shows the exact picture of the newest light.
async function savePng(page) {
  const { scenePictures, lightCanvas, playback } = page;
  const end = performance.now() + PATIENCE_MILLISECONDS;
  while (!scenePictures.isFinal || lightCanvas.isPending) {
    if (performance.now() > end || playback.isPlaying)
      throw new Error('The exact picture is not there yet: let the light rest, and save again.');
    await new Promise(resolve => { setTimeout(resolve, POLLING_MILLISECONDS); });
  }
  get('picture').toBlob(blob => download(blob, `${pictureName(page)}.png`), 'image/png');
}

// Saves what the server makes of the light.
async function saveResponse(path, name, { store, light, lightCanvas, scenePictures }) {
  lightCanvas.drawAtRest();
  const { split } = scenePictures, { sent: { values, shape }, colour } = light, gains = namedGains(store.state, split);
  const response = await request(path, { method: 'POST', body: pack({ shape, colour, split, gains }, values) });
  download(await response.blob(), name);
}

export function namedGains(state, split) {
  const given = gainsOf(state, split);
  return Object.fromEntries(SPLITS[split].map((part, i) => [part, given[i]]));
}

// The name of the light's file, next to that of its picture; of a pair NAME.light.png, NAME.photo.tiff, `evaluate` knows which is which.
export const lightFile = page => `${nameOf(page)}.light.png`;

export const saveLight = page => saveResponse('light.png', lightFile(page), page);

export function bindSaving(page) {
  get('save-png').onclick = showingFaults(() => savePng(page), 'save');
  get('save-exr').onclick = showingFaults(() => saveResponse('picture.exr', `${pictureName(page)}.exr`, page), 'save');
  get('save-light').onclick = showingFaults(() => saveLight(page), 'save');
}
