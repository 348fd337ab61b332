// Lines over the projector's columns, on a log scale.

import { css } from './plots.js';

// Smaller values count as zero.
const FLOOR = 1e-12;
const HEIGHT = 180, LEFT = 38, DECADES = 6, TICKS = 4;

// Each line has a band of one standard deviation, which is the whole plot where the deviation is infinite, and is dotted
// where it is negative. An upright line stands at column `mark`, if there is one.
export function drawProfile(canvas, lines, mark) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth || 600;
  Object.assign(canvas, { width: w * ratio, height: HEIGHT * ratio });
  canvas.style.height = HEIGHT + 'px';
  const pen = canvas.getContext('2d', { willReadFrequently: true });
  pen.scale(ratio, ratio);
  let high = Math.log10(FLOOR);
  for (const { values } of lines) for (const v of values) high = Math.max(high, Math.log10(Math.abs(v) + FLOOR));
  const top = Math.ceil(high), low = top - DECADES, bottom = HEIGHT - 20, count = lines[0].values.length;
  const within = v => Math.min(top, Math.max(low, Math.log10(Math.max(v, FLOOR))));
  const y = v => bottom - (within(v) - low) / DECADES * (bottom - 6), x = i => LEFT + (i + 0.5) / count * (w - LEFT);
  drawAxes(pen, { top, low, bottom, count, w, x, y });
  if (mark !== null) drawUpright(pen, x(mark), bottom);
  for (const line of lines) drawLine(pen, line, x, y);
}

function drawAxes(pen, { top, low, bottom, count, w, x, y }) {
  pen.font = '11px system-ui';
  pen.fillStyle = css('--soft');
  pen.strokeStyle = css('--line');
  for (let power = low; power <= top; power += 2) {
    pen.beginPath(); pen.moveTo(LEFT, y(10 ** power)); pen.lineTo(w, y(10 ** power)); pen.stroke();
    pen.fillText('1e' + power, 0, y(10 ** power) + 4);
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

function drawLine(pen, { values, errors, colour }, x, y) {
  pen.fillStyle = pen.strokeStyle = css(colour);
  pen.globalAlpha = 0.25;
  pen.beginPath();
  for (let i = 0; i < values.length; i++) pen.lineTo(x(i), y(Math.abs(values[i]) + errors[i]));
  for (let i = values.length - 1; i >= 0; i--) pen.lineTo(x(i), y(Math.abs(values[i]) - errors[i]));
  pen.fill();
  pen.globalAlpha = 1;
  pen.lineWidth = 1.5;
  for (const isNegative of [false, true]) {
    pen.setLineDash(isNegative ? [1, 3] : []);
    pen.beginPath();
    for (let i = 1; i < values.length; i++)
      if ((values[i] < 0) === isNegative) { pen.moveTo(x(i - 1), y(Math.abs(values[i - 1]))); pen.lineTo(x(i), y(Math.abs(values[i]))); }
    pen.stroke();
  }
  pen.setLineDash([]);
}
