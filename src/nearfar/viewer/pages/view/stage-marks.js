// Marks on the scene's picture: the camera pixel that was chosen, and the region.

import { get, set } from './dom.js';

// pixel: [y, x] of a camera (height, width), or null.
export function markPixel(pixel, [height, width]) {
  const mark = get('mark');
  set(mark, 'hidden', !pixel);
  if (!pixel) return;
  set(mark.style, 'left', 100 * (pixel[1] + 0.5) / width + '%');
  set(mark.style, 'top', 100 * (pixel[0] + 0.5) / height + '%');
}

// region: [top, left, bottom, right], or null.
export function markRegion(region, [height, width]) {
  const mark = get('region-mark');
  set(mark, 'hidden', !region);
  if (!region) return;
  const [top, left, bottom, right] = region;
  const sides = { top: top / height, left: left / width, height: (bottom - top) / height, width: (right - left) / width };
  for (const [side, share] of Object.entries(sides)) set(mark.style, side, `${100 * share}%`);
}
