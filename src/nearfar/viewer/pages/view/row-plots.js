// A row of the transport as plots: of one camera pixel, or the mean of some.

import { get, set } from './dom.js';
import { crop, drawSigned, drawSpectrum, negativeText } from './plots.js';
import { drawProfile } from './profile.js';
import { hasPart } from './state.js';

// name: what the ids of its elements begin with. Standard deviations are along the projector's row `header.line`.
export function drawRowPlots(name, { header, near, far, nearError, farError, spectrum }, { scene, figures }) {
  const { projector } = scene, [height, width] = projector;
  const around = crop(near, projector, header.q || [height / 2, width / 2], Math.floor(header.window / 2) + 1);
  drawSigned(get(`${name}-window`), around.values, around.shape, figures, 'row');
  const negative = drawSigned(get(`${name}-far`), far, projector, figures, 'row');
  get(`${name}-negative`).textContent = negativeText(negative, figures.colourMap);
  placeCross(get(`${name}-q`), header.q, projector);
  drawSpectrum(get(`${name}-spectrum`), spectrum, projector, header, figures);
  const first = header.line * width;
  const line = (values, errors, colour) => ({ values: values.slice(first, first + width), errors, colour });
  const lines = [line(far, farError, '--far'), ...(hasPart(scene, 'direct') ? [line(near, nearError, '--near')] : [])];
  const { isLog } = drawProfile(get(`${name}-profile`), lines, header.q ? header.q[1] : null, figures, 'row');
  get(`${name}-scale`).textContent = isLog ? 'log scale' : 'linear scale';
}

function placeCross(cross, q, [height, width]) {
  set(cross, 'hidden', !q);
  if (!q) return;
  cross.style.top = `${100 * (q[0] + 0.5) / height}%`;
  cross.style.left = `${100 * (q[1] + 0.5) / width}%`;
}
