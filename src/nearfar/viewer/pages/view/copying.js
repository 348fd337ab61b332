// The dialog that gives the page's picture as a command and as Python.

import { commandOf, describe, loopOf, pythonOf } from './commands.js';
import { get, set, showingFaults } from './dom.js';
import { saveLight } from './saving.js';

// On pages that are not served from this machine, browsers do not let scripts write to the clipboard.
async function copy(id) {
  const text = get(id).textContent;
  try { await navigator.clipboard.writeText(text); } catch {
    getSelection().selectAllChildren(get(id));
    set(get('copied'), 'textContent', 'selected: press Ctrl-C');
    return;
  }
  set(get('copied'), 'textContent', 'copied');
}

export function bindCopying(page) {
  const dialog = get('copying');
  get('copy-as').onclick = () => {
    const shown = describe(page);
    get('as-command').textContent = commandOf(shown);
    get('as-python').textContent = pythonOf(shown);
    get('as-loop').textContent = loopOf(shown);
    get('of-keyframes').hidden = page.store.state.keyframes.length < 2 || page.otherProjectors.isSum;
    get('of-others').hidden = !page.otherProjectors.isSum;
    get('of-others').textContent = `Lights: ${[shown, ...shown.others].map(({ transport, light }) => `${light} of ${transport}`).join(', ')}. Save each on the page of its projector.`;
    get('loop-note').hidden = page.store.state.metering !== 'auto';
    get('copied').textContent = '';
    get('light-file').textContent = shown.light;
    get('transport-file').textContent = shown.transport;
    dialog.showModal();
  };
  for (const id of ['as-command', 'as-python', 'as-loop']) document.querySelector(`[data-copy=${id}]`).onclick = () => copy(id);
  get('copy-light').onclick = showingFaults(() => saveLight(page), 'save');
  get('close-copying').onclick = () => dialog.close();
}
