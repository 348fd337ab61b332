// What the scene's picture shows: the relit scene, or what a tool makes of it.

import { all, get, set } from './dom.js';
import { shareText } from './splits.js';
import { soloOf } from './state.js';

export class Tools {
  #page;
  #tools;
  #open = 'relit';

  // tools: { name: { open, close, lightChanged, frameArrived, changed, label, show } }, of all but the relit scene.
  constructor(page, tools) {
    this.#page = page;
    this.#tools = tools;
    const known = [...all('[data-tool]')].filter(button => this.#canOpen(button.dataset.tool));
    get('tools').hidden = known.length < 2;
    for (const button of all('[data-tool]')) button.hidden = !known.includes(button);
    for (const button of known) button.onclick = () => page.store.update({ tool: button.dataset.tool });
  }

  get #tool() { return this.#tools[this.#open]; }

  // Lamps have no places on a projector, and estimates of some kinds no error bars.
  #canOpen(tool) {
    const { parts, has_error_bars: hasErrorBars } = this.#page.scene;
    return tool === 'relit' || (tool === 'error-bars' ? hasErrorBars : parts.includes('direct'));
  }

  lightChanged() { this.#tool?.lightChanged?.(); }

  // The relit scene is new.
  frameArrived() { this.#tool?.frameArrived?.(); }

  // The state has changed: opens the tool that it names.
  show(state, changes = {}) {
    const tool = this.#canOpen(state.tool) ? state.tool : 'relit';
    if (tool !== this.#open) this.#choose(tool);
    else this.#tool?.changed?.(changes);
    for (const button of all('[data-tool]')) set(button, 'ariaPressed', String(button.dataset.tool === tool));
    for (const panel of all('[data-of-tool]')) set(panel, 'hidden', !panel.dataset.ofTool.split(' ').includes(tool));
    this.#tool?.show?.(state);
    set(get('stage-label'), 'textContent', this.#label(state));
  }

  #choose(tool) {
    const { scenePictures, store } = this.#page;
    this.#tool?.close?.();
    set(get('tool-status'), 'textContent', '');
    scenePictures.replace(null, false, store.state);
    this.#open = tool;
    this.#tool?.open?.();
  }

  #label(state) {
    const { scenePictures } = this.#page, { split } = scenePictures;
    const of = this.#ofProjectors(), label = (this.#tool?.label(state) || this.#relitLabel(state, split)) + (of && `, ${of}`);
    if (!scenePictures.isCompared || scenePictures.isPair(state)) return label;
    return state.difference ? `${label} less ${scenePictures.referenceName}` : `${scenePictures.referenceName} | ${label}`;
  }

  // Of several projectors: which ones the picture is of.
  #ofProjectors() {
    const { scene: { projectors }, otherProjectors: { litCount } } = this.#page;
    if (!projectors.length) return '';
    if (this.#tool) return projectors.find(({ path }) => !path).name;
    return litCount === 1 ? '1 projector lit' : `${litCount} projectors lit`;
  }

  #relitLabel(state, split) {
    const share = shareText(this.#page.scene, state, split);
    return soloOf(state, split) ? share : ['relit', share].filter(Boolean).join(', ');
  }
}
