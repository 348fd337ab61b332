// How the scene and what it is compared with stand: on either side of an edge, beside each other, or as their difference.

import { get, set } from './dom.js';

// Pointing at the second picture, or clicking it, is pointing at the same camera pixel of the first.
export function shareThePointer() {
  const before = get('before'), picture = get('picture');
  for (const type of ['pointermove', 'pointerleave', 'click'])
    before.addEventListener(type, ({ clientX, clientY, pointerId, pointerType }) => {
      const from = before.getBoundingClientRect(), to = picture.getBoundingClientRect();
      picture.dispatchEvent(new PointerEvent(type, { pointerId, pointerType, clientX: clientX - from.left + to.left, clientY: clientY - from.top + to.top }));
    });
}

// isCompared: whether there is something to compare with; isPair: whether both are shown whole; name: of the second.
export function showComparison({ difference, wipe, arrangement }, { isCompared, isPair, name }) {
  const before = get('before'), isWiped = isCompared && !difference && !isPair;
  get('scene-view').classList.toggle('pair', isPair);
  set(before, 'hidden', !isCompared || difference);
  set(before.style, 'clipPath', isPair ? 'none' : `inset(0px ${100 - wipe}% 0px 0px)`);
  set(get('edge'), 'hidden', !isWiped);
  set(get('edge').style, 'left', `calc(${wipe}% - 1px)`);
  set(get('wiping'), 'hidden', !isWiped);
  set(get('comparing'), 'hidden', !isCompared);
  set(get('arrangement'), 'ariaPressed', String(arrangement === 'pair'));
  set(get('difference-figure'), 'hidden', !isCompared || !difference);
  set(get('second-label'), 'hidden', !isPair);
  set(get('second-label'), 'textContent', isPair ? name : '');
}
