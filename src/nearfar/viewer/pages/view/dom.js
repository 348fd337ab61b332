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

export const showFault = text => set(get('fault'), 'textContent', text);

// An asynchronous handler whose error is shown on the page.
export const showingFaults = handler => async (...args) => {
  try { await handler(...args); } catch (error) { showFault(error.message); }
};
