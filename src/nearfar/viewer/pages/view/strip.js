// A row of small pictures under the scene, each with a button.

import { get } from './dom.js';
import { drawPicture, shrink } from './picture.js';

const MAXIMUM_PIXELS = 16384;

export class Strip {
  #items = [];

  // Items { picture, title, detail, isPressed(state), onClick, look }; a look of its own is not that of the page.
  show(items) {
    this.#items = items.map(item => ({ ...item, picture: shrink(item.picture, MAXIMUM_PIXELS), ...element(item) }));
    get('strip').replaceChildren(...this.#items.map(({ figure }) => figure));
  }

  draw(state) {
    for (const { canvas, button, picture, look, isPressed } of this.#items) {
      drawPicture(canvas, picture, look || state);
      button.ariaPressed = String(isPressed(state));
    }
  }
}

function element({ title, detail, onClick }) {
  const figure = document.createElement('figure'), canvas = document.createElement('canvas');
  const button = document.createElement('button'), caption = document.createElement('figcaption');
  canvas.ariaLabel = title;
  button.textContent = title;
  canvas.onclick = button.onclick = onClick;
  caption.textContent = detail;
  figure.append(canvas, button, caption);
  return { figure, canvas, button };
}
