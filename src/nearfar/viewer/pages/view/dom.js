// Elements of the page, and the pointer's position on them.

export const get = id => document.getElementById(id);
export const all = selector => document.querySelectorAll(selector);

// Writing a value that is already there would make the browser lay out the page again.
export const set = (owner, name, value) => { if (owner[name] !== value) owner[name] = value; };

// Position [y, x] of the pointer on an element that shows a grid, in pixels of that grid.
export function positionOn(event, [height, width]) {
  const box = event.target.getBoundingClientRect();
  return [(event.clientY - box.top) / box.height * height - 0.5, (event.clientX - box.left) / box.width * width - 0.5];
}

export const nearestPixel = ([y, x], [height, width]) =>
  [Math.min(height - 1, Math.max(0, Math.round(y))), Math.min(width - 1, Math.max(0, Math.round(x)))];

// What went wrong, by where: a fault is shown until what it is of goes well, or until it is closed.
const faults = new Map();

export function showFault(text, source = '') {
  if (text) faults.set(source, text); else if (!faults.delete(source)) return;
  showFaults();
}

export function closeFaults() {
  faults.clear();
  showFaults();
}

function showFaults() {
  const lines = [...new Set(faults.values())].map(textContent => Object.assign(document.createElement('span'), { textContent }));
  const button = Object.assign(document.createElement('button'), { textContent: 'close', onclick: closeFaults });
  get('fault').replaceChildren(...lines, ...(lines.length ? [button] : []));
}

// An asynchronous handler whose error is shown on the page, until it is called again.
export const showingFaults = (handler, source) => async (...args) => {
  showFault('', source);
  try { await handler(...args); } catch (error) { showFault(error.message, source); }
};
