// Files that are dropped or chosen: pictures to project, and a photo to compare with.

import { get, showFault, showingFaults } from './dom.js';
import { fromFloat16 } from './picture.js';
import { requestMessage } from './protocol.js';

// Offsets in a PNG file.
const PNG_HEAD_BYTES = 26;
const PNG_BIT_DEPTH = 24;

// Pictures of linear light are read by the server: a browser shows them wrong, or not at all.
export async function isLinear(file) {
  if (/\.(tiff?|exr|npy)$/i.test(file.name)) return true;
  const head = new Uint8Array(await file.slice(0, PNG_HEAD_BYTES).arrayBuffer());
  return head[0] === 0x89 && head[1] === 0x50 && head[PNG_BIT_DEPTH] === 16;
}

export async function readByServer(kind, file) {
  get('tool-status').textContent = `Reading ${file.name}.`;
  try {
    return await requestMessage(`read/${kind}?name=${encodeURIComponent(file.name)}`, { method: 'POST', body: file });
  } finally { get('tool-status').textContent = ''; }
}

// The page's policy forbids fetching data: URLs, so they are decoded here.
const blobOf = url => new Blob([Uint8Array.from(atob(url.split(',')[1]), c => c.charCodeAt(0))], { type: 'image/png' });

// Adds the pictures that the address holds; returns how many of them it does not.
export async function restorePictures(urls, light) {
  let missing = 0;
  for (const url of urls)
    try { await light.addPicture(blobOf(url)); } catch { light.addMissing(); missing += 1; }
  return missing;
}

async function addPictures(files, { store, light }) {
  showFault('');
  const first = light.pictureCount;
  for (const file of files) {
    const url = await addPicture(file, light);
    store.update({ pictures: [...store.state.pictures, url] });
  }
  store.update({ kind: 'picture', shown: first });
}

// Returns the picture's data URL; '' for a linear one, which is more than an address holds.
async function addPicture(file, light) {
  if (await isLinear(file)) {
    light.addLinear((await readByServer('light', file)).arrays[0].data);
    return '';
  }
  try { return await light.addPicture(file); } catch { throw new Error(`${file.name} is no picture that the browser knows.`); }
}

async function compareWithPhoto(file, { store, scenePictures }) {
  if (!file) return;
  showFault('');
  const { header, arrays: [{ shape, data }] } = await readByServer('photo', await asReadable(file));
  scenePictures.compareWith({ height: shape[0], width: shape[1], colours: shape[2], values: fromFloat16(data, header.scale) }, 'photo');
  store.update({ wipe: 50 });
}

// The server reads no formats of the web but PNG.
async function asReadable(file) {
  if (!/^image\/(jpeg|webp|gif|avif)$/.test(file.type)) return file;
  const bitmap = await createImageBitmap(file), canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  canvas.getContext('2d', { willReadFrequently: true }).drawImage(bitmap, 0, 0);
  return new File([await canvas.convertToBlob({ type: 'image/png' })], file.name + '.png');
}

// Dropped on the scene, a picture is a photo to compare with, or what the scene is to look like.
async function dropped(files, isOnScene, page) {
  if (!isOnScene) await addPictures(files, page);
  else if (page.store.state.tool === 'compensation') await page.compensation.want(files[0]);
  else await compareWithPhoto(files[0], page);
}

export function bindFiles(page) {
  get('pictures').onchange = showingFaults(async event => { await addPictures([...event.target.files], page); event.target.value = ''; });
  get('photo').onchange = showingFaults(async event => { await compareWithPhoto(event.target.files[0], page); event.target.value = ''; });
  addEventListener('dragover', event => event.preventDefault());
  addEventListener('drop', showingFaults(async event => {
    event.preventDefault();
    const files = [...event.dataTransfer.files];
    if (files.length) await dropped(files, get('stage').contains(event.target), page);
  }));
}
