// The light, drawn pixel by pixel on the projector's grid: linear, 65535 = full white.

const WHITE = 65535;
const linearOf = new Float64Array(256);
for (let i = 0; i < 256; i++) {
  const v = i / 255;
  linearOf[i] = v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
}

export const linearColour = hex => [1, 3, 5].map(i => linearOf[parseInt(hex.slice(i, i + 2), 16)]);
const clamp = v => v < 0 ? 0 : v > 1 ? 1 : v;
const smooth = v => { const t = clamp(v); return t * t * (3 - 2 * t); };

// Each returns how bright the light is at (x, y), of its colour.
const SHAPES = {
  white: () => () => 1,
  spot: s => {
    const inner = s.radius * (1 - s.soft), band = Math.max(2 * s.radius * s.soft, 1);
    return (x, y) => smooth((inner + band - Math.hypot(x - s.x, y - s.y)) / band);
  },
  stripe: s => {
    const a = s.angle * Math.PI / 180, across = [Math.sin(a), -Math.cos(a)];
    return (x, y) => clamp(s.width / 2 + 0.5 - Math.abs((x - s.x) * across[0] + (y - s.y) * across[1]));
  },
  sinusoid: (s, height, width) => {
    const k = 2 * Math.PI * s.cycles / Math.max(height, width), a = s.angle * Math.PI / 180;
    const kx = k * Math.sin(a), ky = k * Math.cos(a), phase = s.phase * Math.PI / 180;
    return (x, y) => 0.5 + 0.5 * Math.cos(kx * x + ky * y - phase);
  },
  checkerboard: s => {
    const side = Math.max(1, Math.round(s.side)), shift = Math.round(s.shift);
    return (x, y) => (Math.floor((x + shift) / side) + Math.floor(y / side)) % 2 ? 0 : 1;
  },
  pixel: s => (x, y) => x === Math.round(s.x) && y === Math.round(s.y) ? 1 : 0,
};

export class Light {
  constructor(height, width) {
    Object.assign(this, { height, width, colour: [1, 1, 1] });
    // What is sent: levels of one channel or three, times the colour.
    this.grey = new Uint16Array(height * width);
    this.coloured = new Uint16Array(height * width * 3);
    this.levels = this.grey;
    this.painted = new Float64Array(height * width * 3);
    // Rasters of the pictures that were dropped, and what was painted so far.
    this.rasters = [];
    this.strokes = [];
    this.points = 0;
  }

  draw(state) {
    const { grey, coloured } = this;
    // What was painted in one colour is relit as quickly as what has one.
    const one = state.strokes.every(s => s.colour === state.strokes[0].colour);
    this.levels = state.kind === 'picture' || state.kind === 'paint' && !one ? coloured : grey;
    this.colour = linearColour(state.kind === 'paint' ? one && state.strokes[0]?.colour || '#ffffff'
      : ['white', 'picture'].includes(state.kind) ? '#ffffff' : state.colour);
    if (state.kind === 'paint') {
      this.paint(state.strokes);
      const brightest = this.colour.indexOf(Math.max(...this.colour)), most = this.colour[brightest] || 1;
      if (one) for (let i = 0; i < grey.length; i++) grey[i] = Math.round(WHITE * this.painted[3 * i + brightest] / most);
      else for (let i = 0; i < coloured.length; i++) coloured[i] = Math.round(WHITE * this.painted[i]);
    } else if (state.kind === 'picture') {
      const raster = this.rasters[Math.min(Math.max(Math.round(state.shown), 0), this.rasters.length - 1)];
      if (raster) coloured.set(raster);
      else coloured.fill(0);
    } else {
      const shape = SHAPES[state.kind](state, this.height, this.width);
      for (let y = 0, i = 0; y < this.height; y++)
        for (let x = 0; x < this.width; x++) grey[i++] = Math.round(WHITE * shape(x, y));
    }
    return this;
  }

  get shape() { return [this.height, this.width, this.levels === this.grey ? 1 : 3]; }

  // Only what was added since the last time, unless something was taken away.
  paint(strokes) {
    const last = this.strokes.at(-1);
    const goesOn = this.strokes.every((s, i) => strokes[i] === s) && (!last || last.points.length >= this.points);
    if (!goesOn) { this.painted.fill(0); this.strokes = []; this.points = 0; }
    for (let i = Math.max(0, this.strokes.length - 1); i < strokes.length; i++) {
      const from = i === this.strokes.length - 1 ? this.points : 0;
      this.stroke(strokes[i], from);
      this.points = strokes[i].points.length;
    }
    this.strokes = [...strokes];
  }

  stroke({ colour, radius, points }, from) {
    const rgb = linearColour(colour);
    if (from === 0) this.dab(points[0], points[1], radius, rgb);
    for (let i = Math.max(2, from); i < points.length; i += 2) {
      const [x0, y0, x1, y1] = points.slice(i - 2, i + 2);
      const steps = Math.max(1, Math.ceil(Math.hypot(x1 - x0, y1 - y0) / (radius / 3)));
      for (let n = 1; n <= steps; n++)
        this.dab(x0 + (x1 - x0) * n / steps, y0 + (y1 - y0) * n / steps, radius, rgb);
    }
  }

  dab(cx, cy, radius, rgb) {
    const reach = Math.ceil(radius) + 1;
    for (let y = Math.max(0, Math.floor(cy) - reach); y <= Math.min(this.height - 1, Math.ceil(cy) + reach); y++)
      for (let x = Math.max(0, Math.floor(cx) - reach); x <= Math.min(this.width - 1, Math.ceil(cx) + reach); x++) {
        const cover = 0.6 * smooth((radius + 0.5 - Math.hypot(x - cx, y - cy)) / (0.7 * radius + 0.5));
        const i = 3 * (y * this.width + x);
        for (let c = 0; c < 3; c++) this.painted[i + c] += cover * (rgb[c] - this.painted[i + c]);
      }
  }

  addLinear(levels) { this.rasters.push(levels.slice()); }

  addNothing() { this.rasters.push(new Uint16Array(this.coloured.length)); }

  // A picture for looking, of 8 bits, from the address or a file: its sRGB is undone.
  async addPicture(source) {
    const bitmap = await createImageBitmap(source);
    const canvas = new OffscreenCanvas(this.width, this.height), pen = canvas.getContext('2d', { willReadFrequently: true });
    const scale = Math.max(this.width / bitmap.width, this.height / bitmap.height);
    const w = bitmap.width * scale, h = bitmap.height * scale;
    pen.imageSmoothingQuality = 'high';
    pen.drawImage(bitmap, (this.width - w) / 2, (this.height - h) / 2, w, h);
    bitmap.close();
    const seen = pen.getImageData(0, 0, this.width, this.height).data;
    const raster = new Uint16Array(this.coloured.length);
    for (let i = 0, j = 0; j < raster.length; i += 4)
      for (let c = 0; c < 3; c++) raster[j++] = Math.round(WHITE * linearOf[seen[i + c]] * seen[i + 3] / 255);
    this.rasters.push(raster);
    const blob = await canvas.convertToBlob({ type: 'image/png' });
    return 'data:image/png;base64,' + btoa(Array.from(new Uint8Array(await blob.arrayBuffer()),
      byte => String.fromCharCode(byte)).join(''));
  }
}
