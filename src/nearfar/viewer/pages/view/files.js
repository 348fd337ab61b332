// Files that are dropped or chosen: pictures to project, and a photo to compare with.

import { get, set, showFault } from './dom.js';
import { fromFloat16 } from './picture.js';
import { PHOTO_URL } from './photo-series.js';
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

const underWay = new Set();

// The server takes seconds to read a file.
export async function readByServer(kind, file) {
  underWay.add(file);
  showReading();
  try {
    return await requestMessage(`read/${kind}?name=${encodeURIComponent(file.name)}`, { method: 'POST', body: file });
  } finally {
    underWay.delete(file);
    showReading();
  }
}

function showReading() {
  const names = [...underWay].map(file => file.name).join(', ');
  set(get('reading'), 'textContent', names && `reading ${names} …`);
}

// Does something with a file; its fault is shown until a file of the same name goes well, whatever others do. Returns what the work
// does, or null.
export async function showingFaultsOf(file, work) {
  showFault('', file.name);
  try { return await work(file); } catch (error) {
    showFault(error.message, file.name);
    return null;
  }
}

// The page's policy forbids fetching data: URLs, so they are decoded here.
const blobOf = url => new Blob([Uint8Array.from(atob(url.split(',')[1]), c => c.charCodeAt(0))], { type: 'image/png' });

// The light of a photo of the capture.
async function lightOfPhoto(url, light, path) {
  const { arrays: [levels] } = await requestMessage(`${path}photo/${PHOTO_URL.exec(url)[1]}`);
  return light.addLinear(levels.data, url);
}

// Adds the pictures that the address holds; returns them, and how many of them it does not. path: of the page that has the photos.
export async function restorePictures(urls, light, path = '') {
  const pictures = [];
  let missing = 0;
  for (const url of urls)
    try { pictures.push(await (PHOTO_URL.test(url) ? lightOfPhoto(url, light, path) : light.addPicture(blobOf(url)))); } catch {
      pictures.push(light.addMissing());
      missing += 1;
    }
  return { pictures, missing };
}

async function addPictures(files, { store, light }) {
  const added = [];
  for (const file of files) added.push(await showingFaultsOf(file, () => addPicture(file, light)));
  const pictures = added.filter(Boolean), before = store.state.pictures;
  if (pictures.length) store.update({ pictures: [...before, ...pictures], kind: 'picture', shown: before.length });
}

// Removes the picture that is shown; keyframes of it go, too.
function removePicture({ store }) {
  const { pictures, shown, keyframes } = store.state;
  const others = keyframes.filter(frame => frame.kind !== 'picture' || frame.shown !== shown);
  store.update({
    pictures: pictures.filter((_, i) => i !== shown), shown: Math.max(0, Math.min(shown, pictures.length - 2)),
    keyframes: others.map(frame => frame.shown > shown ? { ...frame, shown: frame.shown - 1 } : frame),
  });
}

async function addPicture(file, light) {
  if (await isLinear(file)) return light.addLinear((await readByServer('light', file)).arrays[0].data);
  try { return await light.addPicture(file); } catch { throw new Error(`${file.name} is no picture that the browser knows.`); }
}

async function compareWithPhoto(file, { store, scenePictures }) {
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
  else await showingFaultsOf(files[0], file => compareWithPhoto(file, page));
}

export function bindFiles(page) {
  get('pictures').onchange = async event => { await addPictures([...event.target.files], page); event.target.value = ''; };
  get('photo').onchange = async event => {
    for (const chosen of event.target.files) await showingFaultsOf(chosen, file => compareWithPhoto(file, page));
    event.target.value = '';
  };
  get('remove-picture').onclick = () => removePicture(page);
  addEventListener('dragover', event => event.preventDefault());
  addEventListener('drop', async event => {
    event.preventDefault();
    const files = [...event.dataTransfer.files];
    if (files.length) await dropped(files, get('scene-view').contains(event.target), page);
  });
}
