// Puts the page together; each part gets what it needs here, and knows nothing of the others.

import { createAddressWriter, fromAddress } from './address.js';
import { Beside } from './beside.js';
import { Compensation } from './compensation.js';
import { Connection } from './connection.js';
import { bindControls, describe, showControls } from './controls.js';
import { get, nearestPixel, positionOn, showFault } from './dom.js';
import { Dual } from './dual.js';
import { ErrorBars } from './error-bars.js';
import { Figures } from './figures.js';
import { bindFiles, restorePictures } from './files.js';
import { Inspector } from './inspector.js';
import { bindKeeping } from './keeping.js';
import { bindKeyboard } from './keyboard.js';
import { LightCanvas, bindPointer } from './light-canvas.js';
import { Lamps } from './lamps.js';
import { Light } from './light.js';
import { Maps } from './maps.js';
import { meter } from './metering.js';
import { Numbers } from './numbers.js';
import { loadOthers } from './other-lights.js';
import { OtherProjectors } from './other-projectors.js';
import { PhotoSeries } from './photo-series.js';
import { Playback } from './playback.js';
import { Projectors } from './projectors.js';
import { request } from './protocol.js';
import { Reach } from './reach.js';
import { Region } from './region.js';
import { bindSaving } from './saving.js';
import { ScenePictures } from './scene-pictures.js';
import { Splits } from './splits.js';
import { Store, changesLight, initialState } from './state.js';
import { Tabs } from './tabs.js';
import { Tools } from './tools.js';
import { showVerdict } from './verdict.js';

// The scene, and the state and the light that the address asks for.
async function load() {
  const scene = await (await request('scene')).json();
  const initial = initialState(scene), state = fromAddress(location.hash, initial, scene);
  const light = new Light(scene.projector, scene.light_block);
  const { pictures, missing: ofOwn } = await restorePictures(state.pictures, light), last = Math.max(0, pictures.length - 1);
  Object.assign(state, { pictures, shown: Math.min(Math.max(0, Math.round(state.shown)), last) });
  const others = await loadOthers(scene, state.others), missing = others.reduce((sum, other) => sum + other.missing, ofOwn);
  if (missing) showFault(`${missing} of the pictures ${missing > 1 ? 'are' : 'is'} not in the address: drop again what is missing.`, 'address');
  return { scene, initial, state, light, others };
}

async function open() {
  const { scene, initial, state, light, others } = await load();
  const writeAddress = createAddressWriter(initial), scenePictures = new ScenePictures(scene.camera, () => [page.numbers, page.region].forEach(each => each?.refresh()));
  const store = new Store(state, changes => {
    if (changesLight(changes)) {
      scenePictures.lightChanged();
      lightCanvas.requestDraw();
    } else {
      show(changes);
      scenePictures.draw(store.state);
    }
  });
  const otherProjectors = scenePictures.others = new OtherProjectors({ scene, store, others, onArrived: () => { scenePictures.draw(store.state); page.numbers?.refresh(); } });
  const figures = new Figures({ scene, store });
  const playback = new Playback({ store, light }), inspector = new Inspector({ scene, store, tabs: () => tabs, figures }), maps = new Maps({ scene, store, figures });
  const tabs = new Tabs({ store, onShown: () => figures.draw() });
  const lamps = new Lamps(scene), splits = new Splits({ scene, store, onReady: () => connection.lightChanged() });
  const lightCanvas = new LightCanvas({ light, store, lamps, onDrawn: () => { show(); connection.lightChanged(); for (const each of [tools, numbers, region, beside]) each.lightChanged(); } });
  const page = { scene, store, light, lightCanvas, scenePictures, playback, inspector, splits, figures, tabs, initial, otherProjectors };
  Object.assign(page, { dual: new Dual(page), compensation: new Compensation(page) });
  const tools = page.tools = new Tools(page, { reach: new Reach(page), dual: page.dual, compensation: page.compensation, 'error-bars': new ErrorBars(page) });
  const numbers = page.numbers = new Numbers(page);
  describe(scene);
  const region = page.region = new Region(page), beside = page.beside = new Beside(page), photoSeries = new PhotoSeries(page), projectors = new Projectors(page);
  function show(changes) {
    photoSeries.show(store.state); // What the scene is compared with comes before what is said of it.
    const { hasReference, split } = scenePictures, { isPlaying } = playback;
    splits.show(split);
    splits.prepare();
    showControls(store.state, { hasReference, isPlaying, split });
    page.showKept(store.state);
    tools.show(store.state, changes);
    for (const each of [tabs, figures, region, beside, projectors]) each.show(store.state);
    numbers.refresh();
    writeAddress(store.state);
  }

  showVerdict(scene);
  bind(page, show);
  lamps.bind(store);
  lightCanvas.draw();
  show();
  const connection = new Connection({
    light: () => ({ sent: light.sent, colour: light.colour, split: splits.current }),
    onFrame: receiving(page, show),
    onFault: text => showFault(text, 'connection'),
  });
  inspect(state, { inspector, maps });
  beside.compare();
}

const receiving = (page, show) => (header, parts, isNewest) => {
  const { store, lightCanvas, scenePictures, splits, numbers, tools, region } = page, { split } = scenePictures;
  scenePictures.receive(header, parts, isNewest && !lightCanvas.isPending, store.state);
  tools.frameArrived();
  region.refresh();
  meter(page);
  if (header.split === split) numbers.refresh(); else show();
  if (isNewest && header.split !== splits.current) splits.lost();
};

// The edge of what is compared with is dragged.
function bindEdge(store) {
  const edge = get('edge');
  const drag = event => {
    const box = get('stage').getBoundingClientRect();
    store.update({ wipe: Math.min(100, Math.max(0, 100 * (event.clientX - box.left) / box.width)) });
  };
  edge.onpointerdown = event => { edge.setPointerCapture(event.pointerId); drag(event); };
  edge.onpointermove = event => { if (edge.hasPointerCapture(event.pointerId)) drag(event); };
}

// Shows again what the address says was inspected.
function inspect(state, { inspector, maps }) {
  const { tab } = state;
  if (state.pixel) inspector.showRow(...state.pixel, tab);
  if (state.column) inspector.showColumn(...state.column, tab);
  if (state.map) maps.show(state.map);
}

const clicked = (event, size) => nearestPixel(positionOn(event, size), size);

function bind(page, show) {
  const { scene, store, inspector, figures } = page;
  bindControls({ ...page, onTheme: () => figures.draw(), show });
  bindPointer({ store, projector: scene.projector, onPixel: inspector.showColumn });
  bindFiles(page);
  bindSaving(page);
  bindKeyboard(page);
  page.showKept = bindKeeping(page, show);
  get('map').onclick = event => inspector.showRow(...clicked(event, scene.camera));
  // A dual view is one of projector pixels.
  get('picture').onclick = event =>
    store.state.tool === 'dual' ? inspector.showColumn(...clicked(event, scene.projector)) : inspector.showRow(...clicked(event, scene.camera));
  bindEdge(store);
  addEventListener('resize', () => figures.draw());
  addEventListener('hashchange', () => location.reload());
}

open().catch(error => showFault(error.message));
