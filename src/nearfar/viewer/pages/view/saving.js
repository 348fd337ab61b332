// Pictures and lights as files.

import { get, showingFaults } from './dom.js';
import { pack, request } from './protocol.js';
import { SPLITS, gainsOf } from './state.js';

const PATIENCE_MILLISECONDS = 60000;
const POLLING_MILLISECONDS = 50;
const REVOKING_DELAY_MILLISECONDS = 10000;

function download(blob, name) {
  const anchor = document.createElement('a');
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), REVOKING_DELAY_MILLISECONDS);
}

// Saves the canvas as it is displayed, once it shows the exact picture of the newest light.
async function savePng({ store, scenePictures, lightCanvas, playback }) {
  const end = performance.now() + PATIENCE_MILLISECONDS;
  while (!scenePictures.isFinal || lightCanvas.isPending) {
    if (performance.now() > end || playback.isPlaying)
      throw new Error('The exact picture is not there yet: let the light rest, and save again.');
    await new Promise(resolve => { setTimeout(resolve, POLLING_MILLISECONDS); });
  }
  const { tool } = store.state, name = tool === 'compensation' ? 'relit' : tool;
  get('picture').toBlob(blob => download(blob, `${name}.png`), 'image/png');
}

// Saves what the server makes of the light.
async function saveResponse(path, name, { store, light, lightCanvas, scenePictures }) {
  lightCanvas.drawAtRest();
  const { split } = scenePictures, { sent: { values, shape }, colour } = light, given = gainsOf(store.state, split);
  const gains = Object.fromEntries(SPLITS[split].map((part, i) => [part, given[i]]));
  const response = await request(path, { method: 'POST', body: pack({ shape, colour, split, gains }, values) });
  download(await response.blob(), name);
}

export function bindSaving(page) {
  get('save-png').onclick = showingFaults(() => savePng(page));
  get('save-exr').onclick = showingFaults(() => saveResponse('picture.exr', 'relit.exr', page));
  get('save-light').onclick = showingFaults(() => saveResponse('light.png', 'light.png', page));
}
