// Asks for the preview's state again and again, shows it, and sends what the user sets.

import { drawHistogram } from './histogram.js';

const POLLING_MILLISECONDS = 150;
// Share of saturated values from which the meter warns.
const TOO_SATURATED = 0.001;

const get = id => document.getElementById(id);
const patternButtons = () => document.querySelectorAll('[data-pattern]');

const send = settings => fetch('settings', {
  method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(settings),
});

const duration = seconds =>
  seconds < 1 ? (1000 * seconds).toPrecision(4).replace(/\.?0+$/, '') + ' ms' : seconds.toPrecision(3) + ' s';
const percent = share => (100 * share).toFixed(share < 0.01 && share > 0 ? 2 : 1) + ' %';

function showSaturation({ saturated, brightest, mean }) {
  get('saturated').textContent = percent(saturated);
  get('saturation').className = 'meter' + (saturated > TOO_SATURATED ? ' bad' : '');
  get('saturationbar').style.width = 100 * Math.min(1, brightest) + '%';
  get('brightest').textContent = 'brightest ' + percent(brightest) + ' of full scale, mean ' + percent(mean);
}

function showExposure({ exposure, limits }) {
  get('exposure').textContent = exposure ? duration(exposure) : 'set on the camera';
  get('limits').textContent = limits ? `from ${duration(limits[0])} to ${duration(limits[1])}, whole refreshes` : '';
  get('set').hidden = get('automatic').hidden = !limits;
}

function showFocus(focus, best) {
  get('focus').textContent = focus.toPrecision(3);
  get('best').textContent = 'best so far ' + best.toPrecision(3);
  get('focusbar').style.width = 100 * focus / (best || 1) + '%';
}

class Preview {
  #photoNumber = -1;
  #bestFocus = 0;

  forgetBestFocus() { this.#bestFocus = 0; }

  show(state) {
    get('fault').textContent = state.fault || '';
    if (state.number === this.#photoNumber || !state.histogram) return;
    this.#photoNumber = state.number;
    this.#bestFocus = Math.max(this.#bestFocus, state.focus);
    get('photo').src = 'photo.jpg?' + state.number;
    drawHistogram(get('histogram'), state.histogram);
    showFocus(state.focus, this.#bestFocus);
    showSaturation(state);
    showExposure(state);
    get('about').textContent = `${state.camera}, ${state.size}, ${state.channels} ` +
      `${state.channels > 1 ? 'channels' : 'channel'}; projector ${state.monitor}`;
    for (const button of patternButtons()) button.ariaPressed = String(button.dataset.pattern === state.pattern);
  }
}

function bind(preview) {
  for (const button of patternButtons())
    button.onclick = () => { preview.forgetBestFocus(); send({ pattern: button.dataset.pattern }); };
  get('automatic').onclick = () => send({ automatic: true });
  get('set').onsubmit = event => {
    event.preventDefault();
    const milliseconds = parseFloat(get('ms').value);
    if (milliseconds > 0) send({ exposure: milliseconds / 1000 });
  };
  get('stop').onclick = () => send({ stop: true });
  get('again').onclick = () => preview.forgetBestFocus();
}

async function poll(preview) {
  try {
    preview.show(await (await fetch('state')).json());
  } catch {
    get('fault').textContent = 'The preview has ended.';
    return;
  }
  setTimeout(poll, POLLING_MILLISECONDS, preview);
}

const preview = new Preview();
bind(preview);
poll(preview);
