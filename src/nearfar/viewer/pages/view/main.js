// Puts the page together; each part gets what it needs here, and knows nothing of the others.

import { createAddressWriter, fromAddress } from './address.js';
import { Compensation } from './compensation.js';
import { Connection } from './connection.js';
import { bindControls, describe, showControls } from './controls.js';
import { get, nearestPixel, positionOn, showFault } from './dom.js';
import { Dual } from './dual.js';
import { bindFiles, restorePictures } from './files.js';
import { Inspector } from './inspector.js';
import { bindKeyboard } from './keyboard.js';
import { LightCanvas, bindPointer } from './light-canvas.js';
import { Lamps } from './lamps.js';
import { Light } from './light.js';
import { Maps } from './maps.js';
import { Playback } from './playback.js';
import { request } from './protocol.js';
import { Reach } from './reach.js';
import { bindSaving } from './saving.js';
import { ScenePictures } from './scene-pictures.js';
import { Splits } from './splits.js';
import { Store, changesLight, initialState } from './state.js';
import { Tools } from './tools.js';
import { showVerdict } from './verdict.js';

async function open() {
  const scene = await (await request('scene')).json();
  const initial = initialState(scene), state = fromAddress(location.hash, initial);
  const light = new Light(scene.projector, scene.light_block);
  const missing = await restorePictures(state.pictures, light);
  state.shown = Math.min(Math.max(0, Math.round(state.shown)), Math.max(0, light.pictureCount - 1));

  const writeAddress = createAddressWriter(initial), scenePictures = new ScenePictures(scene.camera);
  const store = new Store(state, changes => {
    if (changesLight(changes)) {
      showFault('');
      scenePictures.lightChanged();
      lightCanvas.requestDraw();
    } else {
      show(changes);
      scenePictures.draw(store.state);
    }
  });
  const playback = new Playback({ store, light }), inspector = new Inspector({ scene, store }), maps = new Maps({ scene, store });
  const lamps = new Lamps(scene), splits = new Splits({ scene, store, onReady: () => connection.lightChanged() });
  const lightCanvas = new LightCanvas({ light, store, lamps, onDrawn: () => { show(); connection.lightChanged(); tools.lightChanged(); } });
  const page = { scene, store, light, lightCanvas, scenePictures, playback, inspector, splits };
  Object.assign(page, { dual: new Dual(page), compensation: new Compensation(page) });
  const tools = new Tools(page, { reach: new Reach(page), dual: page.dual, compensation: page.compensation });
  function show(changes) {
    const { hasReference, split } = scenePictures, { isPlaying } = playback;
    splits.show(split);
    splits.prepare();
    showControls(store.state, { pictureCount: light.pictureCount, hasReference, isPlaying, split });
    tools.show(store.state, changes);
    writeAddress(store.state);
  }

  describe(scene);
  showVerdict(scene);
  bind(page, show);
  lamps.bind(store);
  lightCanvas.draw();
  show();
  const connection = new Connection({
    light: () => ({ sent: light.sent, colour: light.colour, split: splits.current }),
    onFrame: receiving(page, show),
    onFault: showFault,
  });
  if (missing) showFault(`${missing} of the pictures ${missing > 1 ? 'are' : 'is'} not in the address: drop again what is missing.`);
  inspect(state, { inspector, maps });
}

const receiving = ({ store, lightCanvas, scenePictures, splits }, show) => (header, parts, isNewest) => {
  const { split } = scenePictures;
  scenePictures.receive(header, parts, isNewest && !lightCanvas.isPending, store.state);
  if (header.split !== split) show();
  if (isNewest && header.split !== splits.current) splits.lost();
};

// Shows again what the address says was inspected.
function inspect(state, { inspector, maps }) {
  if (state.pixel) inspector.showRow(...state.pixel);
  if (state.column) inspector.showColumn(...state.column);
  if (state.map) maps.show(state.map);
}

const clicked = (event, size) => nearestPixel(positionOn(event, size), size);

function bind(page, show) {
  const { scene, store, inspector } = page;
  bindControls({ ...page, onTheme: () => inspector.drawRow(), show });
  bindPointer({ store, projector: scene.projector, onPixel: inspector.showColumn });
  bindFiles(page);
  bindSaving(page);
  bindKeyboard(page);
  get('map').onclick = event => inspector.showRow(...clicked(event, scene.camera));
  // A dual view is one of projector pixels.
  get('picture').onclick = event =>
    store.state.tool === 'dual' ? inspector.showColumn(...clicked(event, scene.projector)) : inspector.showRow(...clicked(event, scene.camera));
  addEventListener('resize', () => inspector.drawRow());
  addEventListener('hashchange', () => location.reload());
}

open().catch(error => showFault(error.message));
