// The table of a region: means and standard deviations, channel by channel.

import { get, set } from './dom.js';
import { tableLine, valueText } from './numbers.js';
import { meanIn } from './picture-values.js';
import { titleOf } from './splits.js';

const CHANNELS = ['red', 'green', 'blue'];

const mean = values => values.reduce((sum, value) => sum + value, 0) / values.length;
const row = (title, values, share = '') => tableLine('td', [title, ...values.map(valueText), share]);

function channelsOf({ length }) {
  if (length === CHANNELS.length) return CHANNELS;
  return length === 1 ? ['light'] : Array.from({ length }, (_, i) => `channel ${i + 1}`);
}

export function showRegionNumbers({ pixels, without_direct: without, saturated, light, components, spread, sigma, noise }, scene) {
  const shareOf = values => `${(100 * mean(values) / (mean(light) || 1)).toFixed(1)} %`;
  get('region-numbers').replaceChildren(
    tableLine('th', ['mean of', ...channelsOf(light), 'share']), row('light', light, shareOf(light)),
    ...Object.entries(components).map(([name, values]) => row(titleOf(scene, name === 'free' ? 'far' : name), values, shareOf(values))),
    row('spread over the region', spread), ...(sigma ? [row('± of one camera pixel', sigma)] : []), row('noise of one measurement', noise));
  get('region-note').textContent = `${pixels} camera pixel${pixels > 1 ? 's' : ''}` +
    (without ? `, ${without} without direct light` : '') + (saturated ? `, ${saturated} saturated` : '') + '. ' +
    'Spread, ± and noise are standard deviations.';
}

// Of the light from the chosen distances, over a region; pictures are that light and all light, or null.
export function showByDistance(pictures, region, camera, title) {
  const [shown, total] = pictures ? pictures.map(picture => mean(meanIn(picture, region, camera))) : [];
  const text = pictures && `${title}: ${valueText(shown)}, ${(100 * shown / (total || 1)).toFixed(1)} % of the region's light`;
  set(get('region-by-distance'), 'textContent', text || '');
}
