// Keys: what they do depends on the element that has the focus.

import { all, get, nearestPixel } from './dom.js';
import { isTyping } from './history.js';
import { SPLITS, hasPart } from './state.js';

const ARROWS = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const SHIFT_PIXELS = 8;
const SOLOS = { d: 'direct', n: 'near', f: 'far', s: 'subsurface', i: 'interreflection', a: '' };
const SPLIT_KEYS = { m: 'model', p: 'physical' };

const moved = ([y, x], arrow, event) => {
  const pixels = event.shiftKey ? SHIFT_PIXELS : 1;
  return [y + pixels * arrow[0], x + pixels * arrow[1]];
};

// A button that was pressed by a pointer keeps no keys for itself.
function releaseFocus() {
  addEventListener('pointerup', () => {
    const focused = document.activeElement;
    if (focused.tagName === 'BUTTON' && focused.role !== 'tab') focused.blur();
  });
}

export function bindKeyboard({ scene, store, inspector, playback, scenePictures, splits, dual }) {
  releaseFocus();
  addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey || isTyping() || document.querySelector('dialog[open]')) return;
    const focused = document.activeElement, arrow = ARROWS[event.key];
    if ((arrow || event.key === 'Enter') && focused === get('light')) onLight(event, arrow);
    else if ((arrow || event.key === 'Enter') && focused === get('picture')) onPicture(event, arrow);
    else if (arrow && focused === get('camera-light')) {
      event.preventDefault();
      dual.move(moved([0, 0], arrow, event));
    }
    else if (focused.tagName !== 'SELECT' && focused.type !== 'file') onPage(event, focused);
  });

  function onLight(event, arrow) {
    const { state } = store;
    if (!arrow) {
      inspector.showColumn(...nearestPixel([state.y, state.x], scene.projector));
      return;
    }
    event.preventDefault();
    const [y, x] = nearestPixel(moved([state.y, state.x], arrow, event), scene.projector);
    store.update({ y, x });
  }

  function onPicture(event, arrow) {
    event.preventDefault();
    if (store.state.tool === 'dual') return;
    const pixel = store.state.pixel || scene.camera.map(side => Math.floor(side / 2));
    inspector.showRow(...nearestPixel(moved(pixel, arrow || [0, 0], event), scene.camera));
  }

  function onPage(event, focused) {
    const kind = all('[data-kind]')[Number(event.key) - 1], solo = SOLOS[event.key];
    if (kind) store.update({ kind: kind.dataset.kind });
    else if (solo !== undefined && (!solo || hasPart(scene, solo) && SPLITS[scenePictures.split].includes(solo))) store.update({ solo });
    else if (event.key === 'k') get('add-keyframe').click();
    else if (SPLIT_KEYS[event.key]) splits.choose(SPLIT_KEYS[event.key]);
    else if (event.key === ' ' && !['BUTTON', 'SUMMARY'].includes(focused.tagName)) {
      event.preventDefault();
      playback.toggle();
    }
  }
}
