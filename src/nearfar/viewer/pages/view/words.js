// What words mean, beside them: under the pointer, and where the keyboard's focus is.

import { all, get } from './dom.js';

const WORDS = {
  q: 'q: the projector pixel that lights this camera pixel directly, as row and column, with fractions.',
  W: 'W: the side of the window about q, in projector pixels or pitches, in which near-range light is estimated.',
  T: 'T, the transport: how much light of each projector pixel reaches each camera pixel. A row of it is of one camera pixel, a column of one projector pixel.',
  'k_far': 'k_far: the highest frequencies of far-range light, in cycles per projector pixel.',
  'k_near': 'k_near: the highest frequencies that were measured for near-range light, in cycles per projector pixel.',
  direct: 'Direct light, D: what comes from q itself.',
  near: 'Near-range light, N: what comes from the window about q, such as light that spreads under a surface.',
  far: 'Far-range light, F: what comes from the whole projector, smooth over it: light from other surfaces.',
  subsurface: 'Subsurface light: what enters a translucent body at one place and leaves it at another.',
  interreflection: 'Inter-reflected light: what comes by way of another surface.',
  snr: 'SNR, signal-to-noise ratio: how much larger the reference is than the difference, in dB; 20 dB is a tenth.',
  sigma: 'After ±: one standard deviation, how far a value is expected to be off.',
  exposure: 'Exposure in stops (EV): each stop doubles what is shown. Numbers stay in photo units.',
  gamma: 'Gamma on top of the sRGB curve: above 1 it lifts the dark parts.',
  'photo units': 'Photo units: linear light, 1 for the photos\' full scale.',
  DC: 'DC: the frequency 0, which is the mean.',
  reach: 'Probing: light of those projector pixels only that lie so far from q.',
  dual: 'Dual view: the scene as the projector would photograph it, lit from the camera\'s side.',
  compensation: 'Compensation: the light under which the scene looks like a given picture, whatever its texture.',
  'error-bars': 'Error bars: one standard deviation of the relit picture, at every camera pixel.',
  model: 'The model\'s split: direct, near-range and far-range light, told apart by where light comes from.',
  physical: 'The physical split: direct, subsurface and inter-reflected light, told apart by how light travels.',
};

const GAP = 6;
const EXPLAINED = '[data-word], [data-solo], [data-split], [data-tool]';

const wordOf = element => element.closest?.(EXPLAINED);

const textOf = ({ word, solo, split, tool }) => WORDS[word || solo || split || tool] || '';

// Above the word, or below it where there is no room.
function place(tip, word) {
  const box = word.getBoundingClientRect(), width = document.documentElement.clientWidth, above = box.top - tip.offsetHeight - GAP;
  tip.style.left = `${Math.max(GAP, Math.min(box.left, width - tip.offsetWidth - GAP))}px`;
  tip.style.top = `${above > GAP ? above : box.bottom + GAP}px`;
}

export function bindWords() {
  const tip = get('tip');
  let explained = null;
  const explain = word => {
    explained = word;
    tip.textContent = word ? textOf(word.dataset) : '';
    tip.hidden = !tip.textContent;
    if (!tip.hidden) place(tip, word);
  };
  for (const word of all('.word')) Object.assign(word, { tabIndex: 0 });
  for (const element of all(EXPLAINED)) element.setAttribute('aria-describedby', 'tip');
  addEventListener('pointerover', event => explain(event.pointerType === 'touch' ? null : wordOf(event.target)));
  addEventListener('focusin', event => explain(event.target.matches(':focus-visible') ? wordOf(event.target) : null));
  addEventListener('focusout', () => explain(null));
  addEventListener('scroll', () => { if (explained) place(tip, explained); }, { passive: true, capture: true });
  addEventListener('keydown', event => { if (event.key === 'Escape') explain(null); });
}
