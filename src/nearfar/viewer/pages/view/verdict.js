// Whether the transport can be trusted: its grade in a word, and why to be opened.

import { get } from './dom.js';

const MEANINGS = {
  good: 'Pictures that no estimate has seen are relit as well as expected, and nothing was found in the photos.',
  doubtful: 'Look at what follows before you rely on it.',
  wrong: 'Do not rely on it: mend what follows, and make the transport again.',
};

const NOT_JUDGED = {
  summary: 'Nothing is known of how far this transport can be trusted.',
  meaning: 'Judge it by the capture that it was reconstructed from: nearfar info TRANSPORT.zarr --capture CAPTURE.zarr',
};

const FIRST_THINGS_FIRST = 'The most probable cause is the first. Mend it first: the others may follow from it.';

export function showVerdict({ verdict, unjudgeable }) {
  const box = get('verdict'), { grade, summary, reasons } = verdict ?? { grade: 'not judged', reasons: [] };
  // The most probable cause leads: how far lights like those shown are off may say less than it.
  get('grade').textContent = `${grade[0].toUpperCase()}${grade.slice(1)}.`;
  get('off-by').textContent = verdict ? [reasons[0], summary].filter(Boolean).join(' ') : NOT_JUDGED.summary;
  const meaning = [MEANINGS[grade], ...(reasons.length > 1 ? [FIRST_THINGS_FIRST] : [])].join(' ');
  get('meaning').textContent = verdict ? meaning : unjudgeable ? `It ${unjudgeable}` : NOT_JUDGED.meaning;
  get('reasons').replaceChildren(...reasons.map(reason => {
    const item = document.createElement('li');
    item.textContent = reason;
    return item;
  }));
  if (verdict) box.classList.add(grade); else box.classList.add('unknown');
  box.hidden = false;
}
