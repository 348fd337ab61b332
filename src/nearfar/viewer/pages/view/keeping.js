// What is kept of the page: steps to undo, views, keyframes, films, and what is copied.

import { bindCopying } from './copying.js';
import { closeFaults } from './dom.js';
import { Film } from './film.js';
import { History } from './history.js';
import { Keyframes } from './keyframes.js';
import { NamedViews } from './named-views.js';
import { SceneView } from './scene-view.js';
import { bindTyped } from './typed.js';
import { bindWords } from './words.js';

// Adds to the page what the parts of it need of each other; returns what shows the state.
export function bindKeeping(page, show) {
  const { store, inspector, playback } = page, keyframes = new Keyframes(page), sceneView = new SceneView(page);
  // A state of before, or of a view, is there.
  const onReturn = changes => {
    if (playback.isPlaying) playback.toggle();
    if (keyframes.isPlaying) keyframes.toggle();
    const { pixel, column, tab } = store.state;
    if ('pixel' in changes && !pixel) inspector.hideRow();
    page.history.quietly(() => {
      if ('pixel' in changes && pixel) inspector.showRow(...pixel, tab);
      if ('column' in changes && column) inspector.showColumn(...column, tab);
    });
  };
  const isPlaying = () => playback.isPlaying || keyframes.isPlaying;
  Object.assign(page, { keyframes, sceneView, onReturn, history: new History({ store, isPlaying, onTravel: onReturn }) });
  Object.assign(page, { film: new Film(page), views: new NamedViews(page) });
  bindCopying(page);
  bindTyped(show);
  bindWords();
  addEventListener('keydown', event => { if (event.key === 'Escape') closeFaults(); });
  let { pixel } = store.state;
  return state => {
    keyframes.show(state);
    sceneView.show(state);
    if (state.pixel !== pixel && state.pixel) sceneView.follow(state.pixel);
    ({ pixel } = state);
  };
}
