// Sums of pictures { height, width, colours, values }.

// A picture at the rows and columns that another one has.
function resampled({ height, width, colours, values }, to) {
  if (to.height === height && to.width === width) return values;
  const found = new Float32Array(to.values.length);
  for (let y = 0, j = 0; y < to.height; y++) {
    const row = Math.min(height - 1, Math.floor((y + 0.5) * height / to.height));
    for (let x = 0; x < to.width; x++) {
      const i = (row * width + Math.min(width - 1, Math.floor((x + 0.5) * width / to.width))) * colours;
      for (let c = 0; c < colours; c++) found[j++] = values[i + c];
    }
  }
  return found;
}

// Adds other pictures to one, in place; returns it.
export function add(picture, others) {
  for (const other of others) {
    const values = resampled(other, picture);
    for (let i = 0; i < values.length; i++) picture.values[i] += values[i];
  }
  return picture;
}
