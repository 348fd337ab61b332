// The sides of a region of the camera picture [top, left, bottom, right], the last two of them beyond it.

import { get, nearestPixel, positionOn, set } from './dom.js';

const CLICK_DISTANCE = 4;

// The region that an address gives, or that was typed; null for none.
export function readRegion(given, [height, width]) {
  if (!Array.isArray(given) || given.length !== 4 || !given.every(Number.isInteger)) return null;
  const [top, left, bottom, right] = given;
  return top >= 0 && left >= 0 && top < bottom && left < right && bottom <= height && right <= width ? given : null;
}

// The region between two camera pixels [y, x], both of them in it.
export const between = ([y, x], [v, u]) => [Math.min(y, v), Math.min(x, u), Math.max(y, v) + 1, Math.max(x, u) + 1];

// The next drag of a finger on the scene makes a region, in place of scrolling the page.
function bindFinger() {
  get('region-drag').hidden = !matchMedia('(any-pointer: coarse)').matches;
  get('region-drag').onclick = () => {
    setDragging(get('region-drag').ariaPressed !== 'true');
    // On a phone the inspector is a sheet before the scene.
    if (get('close-sheet').checkVisibility()) get('close-sheet').click();
  };
}

function setDragging(isDragging) {
  set(get('region-drag'), 'ariaPressed', String(isDragging));
  get('picture').style.touchAction = isDragging ? 'none' : '';
}

// Dragging on the scene makes a region; a press that does not move far is the click that it always was.
// onMove(region) is called on the way, with the one of the state if dragging was broken off; onEnd(region) at the end.
export function bindRegionDrag({ scene: { camera }, store, onMove, onEnd }) {
  bindFinger();
  const canvas = get('picture'), place = event => nearestPixel(positionOn(event, camera), camera);
  let press = null, wasDragged = false;
  canvas.addEventListener('pointerdown', event => {
    wasDragged = false;
    // A finger scrolls the page, unless it is to drag a region; a dual view has no camera pixels.
    const isScrolling = event.pointerType === 'touch' && get('region-drag').ariaPressed !== 'true';
    const isOther = event.button || isScrolling || event.ctrlKey || event.shiftKey || event.altKey;
    if (!isOther && store.state.tool !== 'dual') press = { pointer: event.pointerId, at: [event.clientX, event.clientY], first: place(event) };
  });
  canvas.addEventListener('pointermove', event => {
    if (press?.pointer !== event.pointerId) return;
    const isFar = Math.hypot(event.clientX - press.at[0], event.clientY - press.at[1]) >= CLICK_DISTANCE;
    if (!wasDragged && !isFar) return;
    if (!wasDragged) canvas.setPointerCapture(event.pointerId);
    wasDragged = true;
    onMove(between(press.first, place(event)));
  });
  canvas.addEventListener('pointerup', event => {
    if (press?.pointer !== event.pointerId) return;
    const { first } = press;
    press = null;
    if (wasDragged) {
      setDragging(false);
      onEnd(between(first, place(event)));
    }
    // The click of this press, if there is one, comes before.
    setTimeout(() => { wasDragged = false; });
  });
  canvas.addEventListener('pointercancel', () => {
    press = null;
    onMove(store.state.region);
  });
  canvas.addEventListener('click', event => { if (wasDragged) event.stopImmediatePropagation(); }, { capture: true });
}
