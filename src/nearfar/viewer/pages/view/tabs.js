// The inspector's tabs: beside light and scene on a broad page, in the light's place on a narrower one, a sheet on a phone.

import { all, get, set } from './dom.js';

const BROAD = matchMedia('(min-width: 1400px)');

export class Tabs {
  #store;
  #onShown;
  #shown = '';

  // onShown: a panel has come into view.
  constructor({ store, onShown }) {
    this.#store = store;
    this.#onShown = onShown;
    for (const tab of all('[role=tab]')) tab.onclick = () => this.open(tab.dataset.tab);
    get('close-sheet').onclick = () => this.open('light');
    get('tabs').onkeydown = event => this.#onKey(event);
    BROAD.onchange = () => this.show(store.state);
  }

  // Where the light has a place of its own, its tab is not there.
  #of({ tab }) { return BROAD.matches && tab === 'light' ? 'row' : tab; }

  open(tab) {
    all(`[data-tab=${tab}]`).forEach(button => button.classList.remove('news'));
    this.#store.update({ tab });
  }

  // Opens a tab if the light stays in view, and marks it otherwise.
  offer(tab) {
    if (BROAD.matches) this.open(tab);
    else if (this.#store.state.tab !== tab) document.querySelector(`[data-tab=${tab}]`).classList.add('news');
  }

  show(state) {
    const shown = this.#of(state);
    if (this.#shown === shown) return;
    this.#shown = shown;
    document.body.dataset.shownTab = shown;
    for (const tab of all('[role=tab]')) {
      set(tab, 'ariaSelected', String(tab.dataset.tab === shown));
      tab.tabIndex = tab.dataset.tab === shown ? 0 : -1;
    }
    for (const panel of all('[role=tabpanel]')) panel.hidden = panel.dataset.panel !== shown;
    this.#onShown();
  }

  #onKey(event) {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const tabs = [...all('[role=tab]')].filter(tab => tab.checkVisibility());
    const next = tabs[(tabs.indexOf(document.activeElement) + step + tabs.length) % tabs.length];
    this.open(next.dataset.tab);
    next.focus();
    event.preventDefault();
  }
}
