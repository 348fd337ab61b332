// What the page shows, kept in its address: only what differs from the start.

export const START = {
  kind: 'spot', x: 0, y: 0, radius: 8, soft: 0.5, angle: 90, width: 4, cycles: 4, phase: 0, side: 4,
  shift: 0, brush: 4, shown: 0, colour: '#ffffff', strokes: [], pictures: [],
  direct: 1, near: 1, far: 1, solo: '', exposure: 0, gamma: 1, wipe: 50, map: '', pixel: null,
  column: null, theme: '',
};

// Pictures beyond so many characters stay out of the address.
const LONGEST = 400000;

export function startFor(projector) {
  const [height, width] = projector, side = Math.min(height, width);
  return { ...structuredClone(START), x: (width - 1) / 2, y: (height - 1) / 2,
    radius: Math.max(1, Math.round(side / 4)), width: Math.max(1, Math.round(side / 16)),
    side: Math.max(1, Math.round(side / 16)), brush: Math.max(0.5, Math.round(side / 16)) };
}

export function toAddress(state, start) {
  const changed = {};
  for (const name of Object.keys(start))
    if (JSON.stringify(state[name]) !== JSON.stringify(start[name])) changed[name] = state[name];
  // Places stay, so that the others are found where they were.
  if (changed.pictures && JSON.stringify(changed.pictures).length > LONGEST) changed.pictures = changed.pictures.map(() => '');
  return Object.keys(changed).length ? '#' + encodeURIComponent(JSON.stringify(changed)) : '#';
}

// An address may come from anywhere: what is not of the kind that is expected is left out.
export function fromAddress(hash, start) {
  let told = {};
  try { told = JSON.parse(decodeURIComponent(hash.slice(1))) || {}; } catch { return structuredClone(start); }
  const state = structuredClone(start);
  for (const [name, before] of Object.entries(start)) {
    const value = told[name];
    if (value === undefined) continue;
    if (typeof before === 'number' && Number.isFinite(value)) state[name] = value;
    if (typeof before === 'string' && typeof value === 'string') state[name] = value;
  }
  if (!/^#[0-9a-f]{6}$/i.test(state.colour)) state.colour = start.colour;
  if (!['spot', 'stripe', 'sinusoid', 'checkerboard', 'white', 'paint', 'pixel', 'picture'].includes(state.kind))
    state.kind = start.kind;
  for (const name of ['pixel', 'column'])
    if (Array.isArray(told[name]) && told[name].length === 2 && told[name].every(Number.isInteger))
      state[name] = told[name];
  if (Array.isArray(told.strokes)) state.strokes = told.strokes.filter(isStroke).slice(0, 2000);
  if (Array.isArray(told.pictures))
    state.pictures = told.pictures.slice(0, 100).map(p => typeof p === 'string' && /^data:image\/png;base64,[A-Za-z0-9+/]+=*$/.test(p) ? p : '');
  return state;
}

const isStroke = s => s && /^#[0-9a-f]{6}$/i.test(s.colour) && s.radius >= 0.5 && s.radius < 10000 &&
  Array.isArray(s.points) && s.points.length > 1 && s.points.length % 2 === 0 &&
  s.points.every(p => Number.isFinite(p) && Math.abs(p) < 20000);
