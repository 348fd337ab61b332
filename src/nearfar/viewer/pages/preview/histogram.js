// The histogram of a photo, one line for each channel, on a log scale.

const HEIGHT = 96;
const CHANNEL_COLOURS = ['#c2311a', '#3f9e74', '#1f6ec9'];

export function drawHistogram(canvas, histogram) {
  const pen = canvas.getContext('2d'), style = getComputedStyle(document.body);
  Object.assign(canvas, { width: canvas.clientWidth * devicePixelRatio, height: HEIGHT * devicePixelRatio });
  const highest = Math.log1p(Math.max(...histogram.flat()));
  const colours = histogram.length === 3 ? CHANNEL_COLOURS : [style.color];
  histogram.forEach((counts, channel) => {
    pen.strokeStyle = colours[channel % colours.length];
    pen.lineWidth = 1.5 * devicePixelRatio;
    pen.beginPath();
    counts.forEach((count, i) => pen.lineTo((i + 0.5) / counts.length * canvas.width,
      canvas.height * (1 - 0.96 * Math.log1p(count) / highest) - 1));
    pen.stroke();
  });
}
