// Lines over the projector's columns, on a logarithmic or a linear scale.

import { FLOOR, numberText, ticksOf } from './false-colour.js';
import { css } from './plots.js';

const HEIGHT = 180, LEFT = 38, DECADES = 6, TICKS = 4, LINEAR_TICKS = 3;

// The ends that suit some lines: those of all magnitudes on a logarithmic scale, of all values and zero on a linear one.
function rangeOf(lines, isLog) {
  let high = FLOOR, low = 0;
  for (const { values } of lines)
    for (const value of values) {
      high = Math.max(high, isLog ? Math.abs(value) : value);
      low = Math.min(low, value);
    }
  if (!isLog) return { low, high };
  const top = 10 ** Math.ceil(Math.log10(high));
  return { low: top / 10 ** DECADES, high: top };
}

// Each line has a band of one standard deviation, which is the whole plot where the deviation is infinite, and is dotted
// where it is negative. An upright line stands at column `mark`, if there is one. Returns the range of the scale.
export function drawProfile(canvas, lines, mark, figures, name) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth || 600;
  Object.assign(canvas, { width: w * ratio, height: HEIGHT * ratio });
  canvas.style.height = HEIGHT + 'px';
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.scale(ratio, ratio);
  const range = figures.range(name, true, isLog => rangeOf(lines, isLog)), { low, high, isLog } = range;
  const bottom = HEIGHT - 20, count = lines[0].values.length;
  const place = isLog ? v => Math.log10(Math.max(v, FLOOR) / low) / Math.log10(high / low) : v => (v - low) / (high - low);
  const y = v => bottom - Math.min(1, Math.max(0, place(v))) * (bottom - 6), x = i => LEFT + (i + 0.5) / count * (w - LEFT);
  drawAxes(pen, { ticks: ticksAlong(range), bottom, count, w, x, y });
  if (mark !== null) drawUpright(pen, x(mark), bottom);
  for (const line of lines) drawLine(pen, line, x, y, isLog);
  return range;
}

// Powers of ten where a logarithmic scale has some.
function ticksAlong(range) {
  if (!range.isLog) return ticksOf(range, LINEAR_TICKS);
  const first = Math.ceil(Math.log10(range.low) - 1e-9), last = Math.floor(Math.log10(range.high) + 1e-9);
  if (last - first < 1) return ticksOf(range, 1);
  const step = Math.max(1, Math.ceil((last - first) / TICKS)), powers = [];
  for (let power = first; power <= last; power += step) powers.push(10 ** power);
  return powers;
}

const tickText = value => {
  const power = Math.log10(Math.abs(value));
  return value > 0 && Math.abs(power - Math.round(power)) < 1e-6 && Math.abs(power) > 1.5 ? `1e${Math.round(power)}` : numberText(value);
};

function drawAxes(pen, { ticks, bottom, count, w, x, y }) {
  pen.font = '11px system-ui';
  pen.fillStyle = css('--soft');
  pen.strokeStyle = css('--line');
  for (const tick of ticks) {
    pen.beginPath(); pen.moveTo(LEFT, y(tick)); pen.lineTo(w, y(tick)); pen.stroke();
    pen.fillText(tickText(tick), 0, y(tick) + 4);
  }
  const step = Math.max(1, Math.round((count - 1) / TICKS));
  pen.textAlign = 'center';
  for (let column = 0; column < count; column += step)
    pen.fillText(String(column), Math.min(w - 12, Math.max(LEFT + 4, x(column))), bottom + 15);
  pen.textAlign = 'start';
}

function drawUpright(pen, at, bottom) {
  pen.strokeStyle = css('--mark');
  pen.lineWidth = 1;
  pen.beginPath(); pen.moveTo(at, 4); pen.lineTo(at, bottom); pen.stroke();
}

function drawLine(pen, { values, errors, colour }, x, y, isLog) {
  const shown = isLog ? Math.abs : value => value;
  pen.fillStyle = pen.strokeStyle = css(colour);
  pen.globalAlpha = 0.25;
  pen.beginPath();
  for (let i = 0; i < values.length; i++) pen.lineTo(x(i), y(shown(values[i]) + errors[i]));
  for (let i = values.length - 1; i >= 0; i--) pen.lineTo(x(i), y(shown(values[i]) - errors[i]));
  pen.fill();
  pen.globalAlpha = 1;
  pen.lineWidth = 1.5;
  for (const isNegative of [false, true]) {
    pen.setLineDash(isNegative ? [1, 3] : []);
    pen.beginPath();
    for (let i = 1; i < values.length; i++)
      if ((values[i] < 0) === isNegative) { pen.moveTo(x(i - 1), y(shown(values[i - 1]))); pen.lineTo(x(i), y(shown(values[i]))); }
    pen.stroke();
  }
  pen.setLineDash([]);
}
