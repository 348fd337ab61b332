// Views by name: what the page shows, kept in the browser for this scene.

import { changesOf, stateOf } from './address.js';
import { get, showFault } from './dom.js';
import { restorePictures } from './files.js';
import { initialState } from './state.js';

const MAXIMUM_NAME_CHARACTERS = 60;
// Where the reader is on the page is not the scene's.
const NOT_OF_A_VIEW = ['theme', 'tab', 'map'];

export class NamedViews {
  #page;
  #initial;
  #key;
  // [{ name, state }], states as in addresses.
  #views = [];

  constructor(page) {
    this.#page = page;
    this.#initial = initialState(page.scene);
    this.#key = `nearfar-views-${page.scene.name}`;
    // A page without storage keeps its views until it is closed.
    try { this.#views = JSON.parse(localStorage.getItem(this.#key) || '[]').filter(isView); } catch { this.#views = []; }
    get('view-form').onsubmit = event => {
      event.preventDefault();
      this.#keep(get('view-name').value.trim().slice(0, MAXIMUM_NAME_CHARACTERS));
    };
    this.#show();
  }

  #keep(name) {
    if (!name) return;
    const state = changesOf(this.#page.store.state, this.#initial);
    for (const key of NOT_OF_A_VIEW) delete state[key];
    this.#change([...this.#views.filter(view => view.name !== name), { name, state }]);
    get('view-name').value = '';
  }

  #change(views) {
    this.#views = views;
    this.#show();
    try {
      localStorage.setItem(this.#key, JSON.stringify(views));
      showFault('', 'views');
    } catch { showFault('The browser has no room for this view: remove others.', 'views'); }
  }

  async #open({ state: kept }) {
    const { store, light, scene, onReturn } = this.#page, state = stateOf(kept, this.#initial, scene);
    for (const key of NOT_OF_A_VIEW) delete state[key];
    const urls = store.state.pictures.map(({ url }) => url);
    // Pictures that are there already are not decoded again.
    const isThere = state.pictures.length === urls.length && state.pictures.every((url, i) => url && url === urls[i]);
    const { pictures, missing } = isThere ? { pictures: store.state.pictures, missing: 0 } : await restorePictures(state.pictures, light);
    showFault(missing ? `${missing} of this view's pictures ${missing > 1 ? 'were' : 'was'} too large to keep: drop again what is missing.` : '', 'views');
    store.update({ ...state, pictures, blend: null });
    onReturn(state);
  }

  #show() {
    get('views').replaceChildren(...this.#views.map(view => {
      const item = document.createElement('li'), open = document.createElement('button'), remove = document.createElement('button');
      Object.assign(open, { textContent: view.name, onclick: () => this.#open(view) });
      Object.assign(remove, { textContent: '✕', ariaLabel: `remove the view ${view.name}`, onclick: () => this.#change(this.#views.filter(other => other !== view)) });
      item.append(open, remove);
      return item;
    }));
  }
}

const isView = view => view && typeof view.name === 'string' && view.state && typeof view.state === 'object';
