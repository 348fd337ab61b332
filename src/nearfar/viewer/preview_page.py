"""The page of ``nearfar preview``: alone, nothing fetched but photos."""

from nearfar.report.page import STYLE

_OWN_STYLE = """
.bench { display: grid; grid-template-columns: minmax(0, 1fr) 300px; gap: 1.4rem; margin-top: 1.2rem; }
@media (max-width: 860px) { .bench { grid-template-columns: 1fr; } }
.photo img { image-rendering: auto; background: #000; min-height: 12rem; max-height: 80vh; object-fit: contain; }
.panel > section { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: .8rem 1rem; margin-bottom: .9rem; }
.panel h2 { margin: 0 0 .5rem; font-size: .85rem; color: var(--soft); font-weight: 500; }
.panel b { font-size: 1.3rem; font-variant-numeric: tabular-nums; }
.panel small { color: var(--soft); display: block; }
canvas { width: 100%; height: 96px; display: block; }
button { font: inherit; font-size: .9rem; color: var(--ink); background: var(--back);
  border: 1px solid var(--line); border-radius: 7px; padding: .3rem .7rem; margin: 0 .3rem .4rem 0;
  cursor: pointer; }
button[aria-pressed=true] { border-color: var(--ink); font-weight: 600; }
input { font: inherit; width: 7rem; padding: .25rem .5rem; border: 1px solid var(--line);
  border-radius: 7px; background: var(--back); color: var(--ink); }
.meter { height: 8px; border-radius: 4px; background: var(--line); margin-top: .5rem; }
.meter i { display: block; height: 100%; border-radius: 4px; background: #3f9e74; width: 0; }
.meter.bad i { background: #c2311a; }
#fault { color: #c2311a; max-width: none; min-height: 1.5em; margin: .6rem 0 0; }
"""

_SCRIPT = """
const get = id => document.getElementById(id);
let number = -1, best = 0, ended = false;
const ask = wish => fetch('wish', {method: 'POST', headers: {'Content-Type': 'application/json'},
  body: JSON.stringify(wish)});
for (const button of document.querySelectorAll('[data-pattern]'))
  button.onclick = () => { best = 0; ask({pattern: button.dataset.pattern}); };
get('automatic').onclick = () => ask({automatic: true});
get('set').onsubmit = event => { event.preventDefault();
  const ms = parseFloat(get('ms').value); if (ms > 0) ask({exposure: ms / 1000}); };
get('stop').onclick = () => ask({stop: true});
get('again').onclick = () => { best = 0; };
const time = s => s < 1 ? (1000 * s).toPrecision(4).replace(/\\.?0+$/, '') + ' ms' : s.toPrecision(3) + ' s';
const percent = share => (100 * share).toFixed(share < 0.01 && share > 0 ? 2 : 1) + ' %';
function draw(histogram) {
  const canvas = get('histogram'), pen = canvas.getContext('2d'), style = getComputedStyle(document.body);
  canvas.width = canvas.clientWidth * devicePixelRatio; canvas.height = 96 * devicePixelRatio;
  const most = Math.log1p(Math.max(...histogram.flat()));
  const colours = histogram.length === 3 ? ['#c2311a', '#3f9e74', '#1f6ec9'] : [style.color];
  histogram.forEach((counts, channel) => {
    pen.strokeStyle = colours[channel % colours.length]; pen.lineWidth = 1.5 * devicePixelRatio;
    pen.beginPath();
    counts.forEach((count, i) => pen.lineTo((i + 0.5) / counts.length * canvas.width,
      canvas.height * (1 - 0.96 * Math.log1p(count) / most) - 1));
    pen.stroke();
  });
}
function show(state) {
  get('fault').textContent = state.fault || '';
  if (state.number === number || !state.histogram) return;
  number = state.number;
  get('photo').src = 'photo.jpg?' + number;
  draw(state.histogram);
  best = Math.max(best, state.focus);
  get('focus').textContent = state.focus.toPrecision(3);
  get('best').textContent = 'best so far ' + best.toPrecision(3);
  get('focusbar').style.width = 100 * state.focus / (best || 1) + '%';
  get('saturated').textContent = percent(state.saturated);
  get('saturation').className = 'meter' + (state.saturated > 0.001 ? ' bad' : '');
  get('saturationbar').style.width = 100 * Math.min(1, state.brightest) + '%';
  get('brightest').textContent = 'brightest ' + percent(state.brightest) + ' of full scale, mean ' + percent(state.mean);
  get('exposure').textContent = state.exposure ? time(state.exposure) : 'set on the camera';
  get('limits').textContent = state.limits ?
    'from ' + time(state.limits[0]) + ' to ' + time(state.limits[1]) + ', whole refreshes' : '';
  get('set').hidden = get('automatic').hidden = !state.limits;
  get('about').textContent = state.camera + ', ' + state.size + ', ' + state.channels +
    (state.channels > 1 ? ' channels' : ' channel') + '; projector ' + state.monitor;
  for (const button of document.querySelectorAll('[data-pattern]'))
    button.setAttribute('aria-pressed', button.dataset.pattern === state.pattern);
}
async function look() {
  try { const answer = await fetch('state'); show(await answer.json()); }
  catch { get('fault').textContent = 'The preview has ended.'; ended = true; }
  if (!ended) setTimeout(look, 150);
}
look();
"""

PAGE = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>nearfar preview</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<style>{STYLE}{_OWN_STYLE}</style></head><body><main>
<h1>Preview</h1>
<p id="about">waiting for the first photo</p>
<div>
<button data-pattern="white">white</button><button data-pattern="squares">squares, to focus</button>
<button data-pattern="grey">grey</button><button data-pattern="black">black</button>
<button id="stop" style="float:right">End preview</button>
</div>
<p id="fault" role="alert"></p>
<div class="bench">
<div class="photo"><img id="photo" alt="what the camera sees"></div>
<div class="panel">
<section><h2>Exposure</h2><b id="exposure">…</b><small id="limits"></small>
<form id="set" style="margin:.6rem 0 .3rem"><input id="ms" type="number" step="any" min="0"
 placeholder="ms" aria-label="exposure in milliseconds"> <button>set</button></form>
<button id="automatic">choose for this light</button></section>
<section><h2>Saturated</h2><b id="saturated">…</b><small id="brightest"></small>
<div class="meter" id="saturation"><i id="saturationbar"></i></div>
<small>Saturated camera pixels are red in the picture.</small></section>
<section><h2>Histogram, logarithmic, dark to full scale</h2><canvas id="histogram"></canvas></section>
<section><h2>Focus</h2><b id="focus">…</b> <button id="again">forget</button><small id="best"></small>
<div class="meter"><i id="focusbar"></i></div>
<small>Turn the lens until this is largest; squares tell best.</small></section>
</div></div></main><script>{_SCRIPT}</script></body></html>
"""
