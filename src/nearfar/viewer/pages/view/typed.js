// Sliders' values, which can be typed into as well.

import { all } from './dom.js';

// What a slider counts from 0 and its text from 1.
const FROM_ONE = ['shown'];

const sliderOf = output => output.parentElement.querySelector('input[type=range]');

const nameOf = (output, slider) => slider.ariaLabel || output.parentElement.querySelector('span')?.textContent || slider.dataset.of;

// The number in a text, such as 1.5 in "+1,5 EV"; NaN without one.
const numberIn = text => Number.parseFloat(text.replace(',', '.').replace(/^[^\d+.-]*/, ''));

function commit(output, onEnd) {
  const slider = sliderOf(output), number = numberIn(output.textContent) - (FROM_ONE.includes(slider.dataset.of) ? 1 : 0);
  // A slider keeps to its ends and steps.
  if (Number.isFinite(number) && String(number) !== slider.value) {
    slider.value = number;
    for (const name of ['input', 'change']) slider.dispatchEvent(new Event(name));
  }
  onEnd();
}

function bindOutput(output, show) {
  let before = '';
  const slider = sliderOf(output);
  if (!slider) return;
  Object.assign(output, { contentEditable: 'plaintext-only', tabIndex: 0, role: 'textbox', spellcheck: false, ariaLabel: `${nameOf(output, slider)}, typed` });
  // A label would give the focus to its slider.
  output.onclick = event => event.preventDefault();
  output.onfocus = () => {
    // Gains of the other split are called otherwise.
    output.ariaLabel = `${nameOf(output, slider)}, typed`;
    before = output.textContent;
    getSelection().selectAllChildren(output);
  };
  output.onblur = () => { if (output.textContent !== before) commit(output, show); };
  output.onkeydown = event => {
    if (event.key === 'Escape') output.textContent = before;
    if (event.key !== 'Enter' && event.key !== 'Escape') return;
    event.preventDefault();
    event.stopPropagation();
    output.blur();
    slider.focus();
  };
}

// show(): shows the controls again, as what was typed may be no number.
export function bindTyped(show) {
  for (const output of all('.slider output')) bindOutput(output, show);
}
