import { Link, ask, askPacked, pack } from './link.js';
import { Light } from './light.js';
import { exposureFor, onePart, show, showLevels, sum, unhalve } from './picture.js';
import { crop, drawLog, drawMap, drawProfile, drawSpectrum, gradient } from './plots.js';
import { fromAddress, startFor, toAddress } from './state.js';

const get = id => document.getElementById(id);
const all = selector => document.querySelectorAll(selector);
const PARTS = ['direct', 'near', 'far'];
// The three small pictures are drawn with at most so many camera pixels.
const SMALL = 65536;

let scene, start, state, light, link, frame = null, before = null, playing = 0, saving = 0;

const fault = text => put(get('fault'), 'textContent', text);
const heard = work => async (...given) => { try { await work(...given); } catch (error) { fault(error.message); } };

async function begin() {
  scene = await (await ask('scene')).json();
  start = startFor(scene.projector);
  state = fromAddress(location.hash, start);
  light = new Light(...scene.projector);
  let lost = 0;
  for (const url of state.pictures)
    try { await light.addPicture(pictureOf(url)); } catch { light.addNothing(); lost += 1; }
  state.shown = Math.min(Math.max(0, Math.round(state.shown)), Math.max(0, light.rasters.length - 1));
  const [height, width] = scene.projector, [rows, columns] = scene.camera;
  get('name').textContent = scene.name;
  document.title = `${scene.name} · nearfar`;
  get('about').textContent = `camera ${rows}x${columns}, ${scene.channels} channel${scene.channels > 1 ? 's' : ''}; ` +
    `projector ${height}x${width}; W = ${scene.window}` +
    (scene.plan ? `; ${scene.plan.photos} photos, ${scene.method} estimate` : '');
  get('stage').style.setProperty('--aspect', columns / rows);
  const most = { radius: Math.max(height, width) / 2, width: Math.max(height, width), side: Math.max(height, width) / 2,
    cycles: Math.max(height, width) / 2, shift: Math.max(height, width), brush: Math.max(height, width) / 4 };
  for (const [name, value] of Object.entries(most)) document.querySelector(`[data-of=${name}]`).max = Math.max(1, value);
  get('maps').append(new Option('choose a map', ''), ...scene.maps.map(({ name, title }) => new Option(title, name)));
  get('map-bar').style.background = gradient(scene.scale);
  controls();
  drawLight();
  refresh();
  link = new Link(() => light, shown, fault);
  if (lost) fault(`${lost} of the pictures ${lost > 1 ? 'are' : 'is'} not in the address: drop again what is missing.`);
  if (state.pixel) showRow(...state.pixel);
  if (state.column) showColumn(...state.column);
  if (state.map) showMap(state.map);
}

// What the state says, everywhere on the page.
function refresh() {
  for (const button of all('[data-kind]')) put(button, 'ariaPressed', String(button.dataset.kind === state.kind));
  for (const button of all('[data-solo]')) put(button, 'ariaPressed', String(button.dataset.solo === state.solo));
  for (const part of all('[data-for]')) put(part, 'hidden', !part.dataset.for.split(' ').includes(state.kind));
  put(document.querySelector('[data-of=shown]'), 'max', String(Math.max(0, light.rasters.length - 1)));
  for (const slider of all('[data-of]')) {
    put(slider, 'value', String(state[slider.dataset.of]));
    const output = slider.parentElement.querySelector('output');
    if (output) put(output, 'textContent', spoken(slider.dataset.of));
  }
  put(get('colour'), 'value', state.colour);
  put(get('maps'), 'value', state.map);
  put(get('wiping'), 'hidden', !before);
  put(get('forget'), 'hidden', !before);
  put(document.documentElement.dataset, 'theme', theme());
  put(get('play'), 'disabled', !playing && !canPlay());
  put(get('hint'), 'hidden', !(state.kind === 'paint' && !state.strokes.length || state.kind === 'picture' && !light.rasters.length));
  put(get('hint'), 'textContent', state.kind === 'paint' ? 'drag here to paint' : 'drop pictures here');
  put(get('theme'), 'textContent', theme() === 'dark' ? 'light page' : 'dark page');
  clearTimeout(saving);
  saving = setTimeout(keepInAddress, 250);
}

// What stays as it is costs the browser nothing.
const put = (owner, name, value) => { if (owner[name] !== value) owner[name] = value; };
const keepInAddress = () => history.replaceState(null, '', toAddress(state, start));
const theme = () => state.theme || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
const UNITS = { radius: ' px', width: ' px', brush: ' px', side: ' px', shift: ' px', angle: '°', phase: '°', wipe: ' %' };
function spoken(name) {
  const value = state[name];
  if (name === 'exposure') return (value > 0 ? '+' : '') + value.toFixed(1) + ' EV';
  if (name === 'cycles') return value + ' cycles';
  if (name === 'shown') return `${light.rasters.length ? value + 1 : 0} of ${light.rasters.length}`;
  return (PARTS.includes(name) || name === 'gamma' || name === 'soft' ? value.toFixed(2) : +value.toFixed(1)) + (UNITS[name] || '');
}

const drawLight = () => showLevels(get('light'), light.draw(state));
// What has nothing to move does not play.
const canPlay = () => !['white', 'paint'].includes(state.kind) && (state.kind !== 'picture' || light.rasters.length > 1);

let drawn = 0;
function relight(changes) {
  Object.assign(state, changes);
  fault('');
  // However often a pointer tells where it is, once for each time the screen is drawn.
  drawn ||= requestAnimationFrame(() => { drawn = 0; drawLight(); refresh(); link.change(); });
}

function look(changes) {
  Object.assign(state, changes);
  refresh();
  paintFrame();
}

// Pictures

let times = [], pictures = 0;
function shown(words, parts, newest) {
  frame = { ...words, newest, parts: { ...parts, scale: words.scale } };
  times = times.filter(time => time > performance.now() - 1000);
  times.push(performance.now());
  paintFrame();
  const what = (words.exact ? '' : 'while it moves: ') +
    (words.step > 1 ? `one row and column in ${words.step}` : 'every camera pixel');
  const rate = times.length > 2 ? `${times.length} pictures a second · ` : '';
  put(get('told'), 'textContent', rate + what);
  pictures += 1;
  document.body.dataset.shown = JSON.stringify({ pictures, exact: words.exact, newest });
}

const gains = () => PARTS.map(name => !state.solo || state.solo === name ? state[name] : 0);

function paintFrame() {
  if (!frame) return;
  show(get('picture'), sum(frame.parts, gains()), state);
  PARTS.forEach((name, i) => show(get('part' + i), small(onePart(frame.parts, i, state[name])), state));
  if (before) show(get('before'), before, state);
  put(get('before'), 'hidden', !before);
  put(get('edge'), 'hidden', !before);
  put(get('before').style, 'clipPath', `inset(0px ${100 - state.wipe}% 0px 0px)`);
  put(get('edge').style, 'left', `calc(${state.wipe}% - 1px)`);
  mark();
}

function small(picture) {
  const step = Math.ceil(Math.sqrt(picture.height * picture.width / SMALL));
  if (step === 1) return picture;
  const height = Math.ceil(picture.height / step), width = Math.ceil(picture.width / step), { colours } = picture;
  const values = new Float32Array(height * width * colours);
  for (let y = 0, j = 0; y < height; y++)
    for (let x = 0; x < width; x++)
      for (let c = 0; c < colours; c++) values[j++] = picture.values[((y * picture.width + x) * step) * colours + c];
  return { height, width, colours, values };
}

function mark() {
  const [rows, columns] = scene.camera;
  put(get('mark'), 'hidden', !state.pixel);
  if (!state.pixel) return;
  put(get('mark').style, 'left', 100 * (state.pixel[1] + 0.5) / columns + '%');
  put(get('mark').style, 'top', 100 * (state.pixel[0] + 0.5) / rows + '%');
}

// One pixel, or a map

let under = null;
async function newestOf(path) {
  under?.abort();
  const mine = under = new AbortController();
  const answer = await askPacked(path, { signal: mine.signal }).catch(error => { if (!mine.signal.aborted) throw error; });
  return mine.signal.aborted ? null : answer;
}

const showRow = heard(async (y, x) => {
  look({ pixel: [y, x] });
  row = await newestOf(`row?y=${y}&x=${x}`) || row;
  drawRow();
});

// Again when the page's colours or its width change.
let row = null;
function drawRow() {
  if (!row) return;
  const { words, arrays: [near, far, nearError, farError, spectrum] } = row, { y, x } = words;
  const { projector, scale } = scene, [height, width] = projector;
  get('row').hidden = false;
  get('pixel').textContent = `row ${y}, column ${x}`;
  const floodlit = words.floodlit, total = floodlit.direct + floodlit.near + floodlit.far;
  const share = name => `${name} ${(100 * floodlit[name] / (total || 1)).toFixed(1)} %`;
  const q = words.q && words.q.map(v => v.toFixed(2));
  get('pixel-told').textContent =
    (q ? `q = (${q[0]}, ${q[1]})` : 'no direct light') +
    (words.confidence === null ? '' : `, confidence ${words.confidence.toFixed(2)}`) +
    `; floodlit ${total.toPrecision(3)}: ${PARTS.map(share).join(', ')}` +
    (words.no_errors && `; no error bars: ${words.no_errors}`) +
    (words.saturated ? '; saturated under white' : '');
  const centre = words.q || [height / 2, width / 2];
  const around = crop(near.data, projector, centre, Math.ceil(words.window / 2) + 1);
  drawLog(get('row-window'), around.values, around.shape, scale);
  drawLog(get('row-far'), far.data, projector, scale);
  drawSpectrum(get('row-spectrum'), spectrum.data, projector, words, scale);
  const from = words.line * width;
  const line = (values, errors, colour) => ({ values: values.data.slice(from, from + width), errors: errors.data, colour });
  drawProfile(get('row-profile'), [line(far, farError, '--far'), line(near, nearError, '--near')],
    'orange: direct and near-range, green: far-range; projector column 0 to ' + (width - 1));
}

const showColumn = heard(async (y, x) => {
  look({ column: [y, x] });
  const { words, arrays: [values] } = await askPacked(`column?y=${y}&x=${x}`);
  get('column-map').hidden = false;
  get('column').textContent = `row ${y}, column ${x}`;
  const high = drawLog(get('column-map'), values.data, values.shape, scene.scale);
  get('column-told').textContent = `${(10 ** (high - 5)).toPrecision(2)} to ${(10 ** high).toPrecision(2)} photo units` +
    (words.step > 1 ? `, one row and column in ${words.step}` : '');
});

let mapped = null;
const showMap = heard(async name => {
  look({ map: name });
  for (const id of ['map', 'map-bar']) get(id).hidden = !name;
  for (const id of ['map-low', 'map-high', 'map-told', 'map-value']) get(id).textContent = '';
  if (!name) return;
  get('map-told').textContent = 'computing';
  const { words, arrays: [values] } = await askPacked(`map/${name}`)
    .catch(error => { get('map-told').textContent = ''; throw error; });
  if (state.map !== name) return;
  mapped = { ...words, ...values };
  drawMap(get('map'), values.data, values.shape, words.low, words.high, scene.scale);
  const unit = words.unit && ' ' + words.unit;
  get('map-low').textContent = +words.low.toPrecision(3) + unit;
  get('map-high').textContent = +words.high.toPrecision(3) + unit;
  get('map-told').textContent = words.title + '; grey where there is none';
});

// Where a pointer is, in pixels of a grid.
function placeOn(event, [height, width]) {
  const box = event.target.getBoundingClientRect();
  return [(event.clientY - box.top) / box.height * height - 0.5, (event.clientX - box.left) / box.width * width - 0.5];
}
const within = ([y, x], [height, width]) =>
  [Math.min(height - 1, Math.max(0, Math.round(y))), Math.min(width - 1, Math.max(0, Math.round(x)))];
const rounded = v => Math.round(4 * v) / 4;

// Controls

function controls() {
  for (const button of all('[data-kind]')) button.onclick = () => relight({ kind: button.dataset.kind });
  for (const button of all('[data-solo]'))
    button.onclick = () => look({ solo: state.solo === button.dataset.solo ? '' : button.dataset.solo });
  const seen = [...PARTS, 'exposure', 'gamma', 'wipe'];
  for (const slider of all('[data-of]'))
    slider.oninput = () => {
      const name = slider.dataset.of;
      (seen.includes(name) ? look : relight)({ [name]: slider.valueAsNumber });
    };
  get('colour').oninput = () => relight({ colour: get('colour').value });
  get('theme').onclick = () => { look({ theme: theme() === 'dark' ? 'light' : 'dark' }); drawRow(); };
  addEventListener('resize', drawRow);
  get('play').onclick = play;
  get('undo').onclick = () => relight({ strokes: state.strokes.slice(0, -1) });
  get('clear').onclick = () => relight({ strokes: [] });
  get('expose').onclick = () => frame && look({ exposure: exposureFor(sum(frame.parts, gains())) });
  get('reset').onclick = () => look({ exposure: 0, gamma: 1, direct: 1, near: 1, far: 1, solo: '' });
  get('keep').onclick = () => { if (frame?.exact) { before = sum(frame.parts, gains()); look({ wipe: 50 }); } };
  get('forget').onclick = () => { before = null; look({}); };
  get('maps').onchange = () => showMap(get('maps').value);
  get('map').onpointermove = event => {
    const [y, x] = within(placeOn(event, mapped.shape), mapped.shape), value = mapped.data[y * mapped.shape[1] + x];
    get('map-value').textContent = Number.isFinite(value) ? +value.toPrecision(4) + ' ' + mapped.unit : 'none';
  };
  get('map').onclick = event => showRow(...within(placeOn(event, scene.camera), scene.camera));
  get('picture').onclick = event => showRow(...within(placeOn(event, scene.camera), scene.camera));
  get('pictures').onchange = heard(async event => { await addLights([...event.target.files]); event.target.value = ''; });
  get('photo').onchange = heard(async event => { await addPhoto(event.target.files[0]); event.target.value = ''; });
  get('save-png').onclick = heard(savePng);
  get('save-exr').onclick = heard(() => saveFrom('picture.exr', 'relit.exr'));
  get('save-light').onclick = heard(() => saveFrom('light.png', 'light.png'));
  drawing(get('light'));
  addEventListener('dragover', event => event.preventDefault());
  addEventListener('drop', heard(async event => {
    event.preventDefault();
    const files = [...event.dataTransfer.files];
    if (files.length) await (get('stage').contains(event.target) ? addPhoto(files[0]) : addLights(files));
  }));
  addEventListener('keydown', keys);
  addEventListener('hashchange', () => location.reload());
  matchMedia('(prefers-color-scheme: dark)').onchange = refresh;
}

const moveTo = event => {
  const [y, x] = placeOn(event, scene.projector).map(rounded);
  if (state.kind === 'paint') {
    const last = state.strokes.at(-1);
    if (last.points.at(-2) === x && last.points.at(-1) === y) return;
    last.points.push(x, y);
    relight({});
  } else relight({ x, y });
};

function drawing(canvas) {
  let pressed = null;
  canvas.onpointerdown = event => {
    if (event.button || pressed) return;
    canvas.setPointerCapture(event.pointerId);
    pressed = placeOn(event, scene.projector);
    Object.assign(pressed, { id: event.pointerId, at: [event.clientX, event.clientY] });
    if (state.kind === 'paint') {
      state.strokes = [...state.strokes, { colour: state.colour, radius: state.brush, points: [] }];
    }
    fault('');
    if (!['white', 'sinusoid', 'checkerboard', 'picture'].includes(state.kind)) moveTo(event);
  };
  canvas.onpointermove = event => {
    if (pressed?.id === event.pointerId) dragged(event, pressed);
  };
  canvas.onpointercancel = event => { if (pressed?.id === event.pointerId) pressed = null; };
  canvas.onpointerup = event => {
    if (pressed?.id !== event.pointerId) return;
    const [y, x] = placeOn(event, scene.projector);
    const still = Math.hypot(event.clientX - pressed.at[0], event.clientY - pressed.at[1]) < 4;
    pressed = null;
    if (still && state.kind !== 'paint' || state.kind === 'pixel') showColumn(...within([y, x], scene.projector));
  };
}

// What has no place is shifted, or turned on.
let dragFrom = null;
function dragged(event, pressed) {
  if (state.kind === 'sinusoid' || state.kind === 'checkerboard') {
    if (dragFrom?.pressed !== pressed) dragFrom = { pressed, phase: state.phase, shift: state.shift };
    const [y, x] = placeOn(event, scene.projector), dy = y - pressed[0], dx = x - pressed[1];
    if (state.kind === 'checkerboard') return relight({ shift: Math.max(0, Math.round(dragFrom.shift - dx)) });
    const angle = state.angle * Math.PI / 180, along = dx * Math.sin(angle) + dy * Math.cos(angle);
    const turns = along * state.cycles / Math.max(...scene.projector);
    return relight({ phase: ((Math.round(dragFrom.phase + 360 * turns) % 360) + 360) % 360 });
  }
  if (!['white', 'picture'].includes(state.kind)) moveTo(event);
}

const ARROWS = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
function keys(event) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const arrow = ARROWS[event.key], far = event.shiftKey ? 8 : 1, at = document.activeElement;
  if (arrow && at === get('light')) {
    event.preventDefault();
    const [y, x] = within([state.y + far * arrow[0], state.x + far * arrow[1]], scene.projector);
    return relight({ y, x });
  }
  if ((arrow || event.key === 'Enter') && at === get('picture')) {
    event.preventDefault();
    const [y, x] = state.pixel || scene.camera.map(side => Math.floor(side / 2)), by = arrow || [0, 0];
    return showRow(...within([y + far * by[0], x + far * by[1]], scene.camera));
  }
  if (event.key === 'Enter' && at === get('light')) return showColumn(...within([state.y, state.x], scene.projector));
  if (['INPUT', 'SELECT'].includes(at.tagName)) return;
  const kind = all('[data-kind]')[Number(event.key) - 1];
  const solo = { d: 'direct', n: 'near', f: 'far', a: '' }[event.key];
  if (kind) relight({ kind: kind.dataset.kind });
  else if (solo !== undefined) look({ solo });
  else if (event.key === ' ' && at.tagName !== 'BUTTON') { event.preventDefault(); play(); }
}

// A sequence: whatever the kind of light does over time.
function play() {
  if (!playing && !canPlay()) return;
  playing = playing ? 0 : performance.now();
  get('play').setAttribute('aria-pressed', Boolean(playing));
  get('play').textContent = playing ? 'stop' : 'play';
  const [height, width] = scene.projector, from = { ...state }, began = playing;
  const step = now => {
    if (playing !== began || !playing) return;
    const t = Math.max(0, now - began) / 1000, turn = 2 * Math.PI * t / 6;
    const about = { x: (width - 1) / 2 * (1 + 0.7 * Math.cos(turn)), y: (height - 1) / 2 * (1 + 0.7 * Math.sin(turn)) };
    relight({
      spot: about, paint: {}, white: {}, stripe: { x: (t / 5 % 1) * width, y: (t / 5 % 1) * height },
      pixel: { x: Math.floor(8 * t) % width, y: Math.floor(8 * t / width) % height },
      sinusoid: { phase: Math.round(from.phase + 120 * t) % 360 }, checkerboard: { shift: Math.floor(6 * t) % Math.max(1, 2 * state.side) },
      picture: { shown: light.rasters.length ? Math.floor(t) % light.rasters.length : 0 },
    }[state.kind]);
    requestAnimationFrame(step);
  };
  if (playing) requestAnimationFrame(step);
}

// Files

// Linear lights, which a browser shows wrong or not at all, are read by the server.
async function isLinear(file) {
  if (/\.(tiff?|exr|npy)$/i.test(file.name)) return true;
  const head = new Uint8Array(await file.slice(0, 26).arrayBuffer());
  return head[0] === 0x89 && head[1] === 0x50 && head[24] === 16;
}

const send = (kind, file) => askPacked(`read/${kind}?name=${encodeURIComponent(file.name)}`, { method: 'POST', body: file });

async function addLights(files) {
  fault('');
  const first = light.rasters.length;
  for (const file of files) {
    if (await isLinear(file)) {
      light.addLinear((await send('light', file)).arrays[0].data);
      // It holds more than an address does; its place is kept.
      state.pictures = [...state.pictures, ''];
    } else {
      const url = await light.addPicture(file).catch(() => { throw new Error(`${file.name} is no picture that the browser knows.`); });
      state.pictures = [...state.pictures, url];
    }
  }
  relight({ kind: 'picture', shown: first });
}

async function addPhoto(file) {
  if (!file) return;
  fault('');
  let sent = file;
  if (/^image\/(jpeg|webp|gif|avif)$/.test(file.type)) {
    const bitmap = await createImageBitmap(file), canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    canvas.getContext('2d', { willReadFrequently: true }).drawImage(bitmap, 0, 0);
    sent = new File([await canvas.convertToBlob({ type: 'image/png' })], file.name + '.png');
  }
  const { words, arrays: [{ shape, data }] } = await send('photo', sent);
  before = { height: shape[0], width: shape[1], colours: shape[2], values: unhalve(data, words.scale) };
  look({ wipe: 50 });
}

// The page may ask nothing of an address but its own, a data: address either.
const pictureOf = url => new Blob([Uint8Array.from(atob(url.split(',')[1]), c => c.charCodeAt(0))], { type: 'image/png' });

function download(blob, name) {
  const anchor = document.createElement('a');
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}

// As it is seen; the exact picture, once it is there.
async function savePng() {
  const end = performance.now() + 60000;
  while (!frame?.exact || !frame.newest || drawn) {
    if (performance.now() > end || playing) throw new Error('The exact picture is not there yet: let the light rest, and save again.');
    await new Promise(done => setTimeout(done, 50));
  }
  get('picture').toBlob(blob => download(blob, 'relit.png'), 'image/png');
}

async function saveFrom(path, name) {
  const [direct, near, far] = gains();
  const { levels, shape, colour } = light;
  const answer = await ask(path, { method: 'POST', body: pack({ shape, colour, gains: { direct, near, far } }, levels) });
  download(await answer.blob(), name);
}

begin().catch(error => fault(error.message));
