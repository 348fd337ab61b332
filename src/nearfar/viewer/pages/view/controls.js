// Buttons and sliders: they change the state, and show it.

import { all, get, set } from './dom.js';
import { zoomLight } from './light-canvas.js';
import { ONE_PIXEL } from './painting.js';
import { canPlay } from './playback.js';
import { ALL_ONE, hasPart, isFree, limitsOf, soloOf } from './state.js';

const UNITS = { radius: ' px', width: ' px', brush: ' px', reach: ' px', broad: ' px', cameraRadius: ' px', side: ' px', shift: ' px', seconds: ' s', angle: '°', phase: '°', wipe: ' %' };
const BROADEST = 8;
const TWO_DECIMALS = [...Object.keys(ALL_ONE), 'gamma', 'soft'];

// What the page is of, and how far its sliders go.
export function describe(scene) {
  const [height, width] = scene.projector, [rows, columns] = scene.camera;
  get('name').textContent = scene.name;
  document.title = `${scene.name} · nearfar`;
  const window = Object.assign(document.createElement('span'), { className: 'word', textContent: 'W' });
  window.dataset.word = 'W';
  get('about').replaceChildren(`camera ${rows}x${columns}, ${scene.channels} channel${scene.channels > 1 ? 's' : ''}; ` +
    (hasPart(scene, 'direct') ? `projector ${height}x${width}` : `${height * width} lamps`),
  ...(scene.parts.includes('near') ? ['; ', window, ` = ${scene.window}`] : []),
  (scene.pitch > 1 ? ` every ${scene.pitch} projector pixels` : '') + (scene.plan ? `; ${scene.plan.photos} photos, ${scene.method} estimate` : ''));
  get('parts').hidden = scene.parts.length === 1;
  if (isFree(scene)) {
    get('row-far-title').textContent = document.querySelector('.far-text').textContent = 'each lamp';
    document.querySelector('.near-text').textContent = 'direct';
    for (const id of ['row-window', 'row-spectrum']) get(id).closest('figure').hidden = true;
  }
  get('scene-view').style.setProperty('--aspect', columns / rows);
  // Lines of lamps and of pixels are drawn broad enough to point at.
  const isLine = Math.min(height, width) === 1, aspect = width / height;
  get('pane').style.setProperty('--aspect', isLine ? Math.min(BROADEST, Math.max(1 / BROADEST, aspect)) : aspect);
  for (const [name, [low, high]] of Object.entries(limitsOf(scene))) if (slider(name)) Object.assign(slider(name), { min: low, max: high });
}

const slider = name => document.querySelector(`[data-of=${name}]`);
const prefersDark = matchMedia('(prefers-color-scheme: dark)');
const theme = state => state.theme || (prefersDark.matches ? 'dark' : 'light');

// onTheme: the page's colours have changed; show: shows the controls again.
export function bindControls({ store, scenePictures, playback, onTheme, show }) {
  for (const button of all('[data-kind]')) button.onclick = () => store.update({ kind: button.dataset.kind });
  for (const button of all('[data-solo]'))
    button.onclick = () => store.update({ solo: store.state.solo === button.dataset.solo ? '' : button.dataset.solo });
  for (const input of all('[data-of]')) input.oninput = () => store.update({ [input.dataset.of]: input.valueAsNumber });
  document.querySelector('[data-of=exposure]').oninput = event => store.update({ exposure: event.target.valueAsNumber, metering: 'fixed' });
  get('metering').onclick = () => store.update(store.state.metering === 'auto' ? { metering: 'fixed' }
    : { metering: 'auto', exposure: scenePictures.exposure(store.state) ?? store.state.exposure });
  get('colour').oninput = () => store.update({ colour: get('colour').value });
  get('play').onclick = () => playback.toggle();
  get('clear').onclick = () => store.update({ strokes: [] });
  get('reset').onclick = () => store.update({ exposure: 0, metering: 'fixed', gamma: 1, ...ALL_ONE, solo: '' });
  get('expose').onclick = () => {
    const exposure = scenePictures.exposure(store.state);
    if (exposure !== null) store.update({ exposure });
  };
  get('difference').onclick = () => store.update({ difference: !store.state.difference });
  get('keep').onclick = () => { if (scenePictures.keepAsReference(store.state)) store.update({ wipe: 50 }); };
  get('forget').onclick = () => { scenePictures.removeReference(); store.update({ difference: false }); };
  get('theme').onclick = () => { store.update({ theme: theme(store.state) === 'dark' ? 'light' : 'dark' }); onTheme(); };
  prefersDark.onchange = show;
}

export function showControls(state, { hasReference, isPlaying, split }) {
  const pictureCount = state.pictures.length;
  for (const button of all('[data-kind]')) set(button, 'ariaPressed', String(button.dataset.kind === state.kind));
  for (const button of all('[data-solo]')) set(button, 'ariaPressed', String(button.dataset.solo === soloOf(state, split)));
  for (const part of all('[data-for]')) set(part, 'hidden', !part.dataset.for.split(' ').includes(state.kind));
  set(slider('shown'), 'max', String(Math.max(0, pictureCount - 1)));
  for (const input of all('[data-of]')) {
    set(input, 'value', String(state[input.dataset.of]));
    const output = input.parentElement.querySelector('output');
    // Not while somebody types into it.
    if (output && output !== document.activeElement) set(output, 'textContent', valueText(input.dataset.of, state, pictureCount));
  }
  zoomLight(state.zoom);
  set(get('colour'), 'value', state.colour);
  set(get('maps'), 'value', state.map);
  set(get('difference'), 'ariaPressed', String(state.difference));
  set(get('metering'), 'ariaPressed', String(state.metering === 'auto'));
  set(get('remove-picture'), 'disabled', !pictureCount);
  set(get('forget'), 'hidden', !hasReference);
  set(document.documentElement.dataset, 'theme', theme(state));
  set(get('theme'), 'textContent', theme(state) === 'dark' ? 'light page' : 'dark page');
  set(get('play'), 'disabled', !isPlaying && !canPlay(state));
  showHint(state, pictureCount);
}

function showHint(state, pictureCount) {
  const isEmpty = state.kind === 'paint' && !state.strokes.length || state.kind === 'picture' && !pictureCount;
  set(get('hint'), 'hidden', !isEmpty);
  set(get('hint'), 'textContent', state.kind === 'paint' ? 'drag here to paint' : 'drop pictures here');
}

function valueText(name, state, pictureCount) {
  const value = state[name];
  if (name === 'exposure') return (value > 0 ? '+' : '') + value.toFixed(1) + ' EV';
  if (name === 'cycles') return value + ' cycles';
  if (['brush', 'cameraRadius'].includes(name) && value <= ONE_PIXEL) return 'one pixel';
  if (name === 'zoom') return value + 'x';
  if (name === 'shown') return `${pictureCount ? value + 1 : 0} of ${pictureCount}`;
  return (TWO_DECIMALS.includes(name) ? value.toFixed(2) : +value.toFixed(1)) + (UNITS[name] || '');
}
