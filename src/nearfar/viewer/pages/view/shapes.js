// Lights that a formula gives: brightness at (x, y), from 0 to 1.

export const clamp = value => value < 0 ? 0 : value > 1 ? 1 : value;
export const smooth = value => { const t = clamp(value); return t * t * (3 - 2 * t); };

// Quicker than Math.hypot, which a grid of millions of pixels asks for at every one.
export const distance = (dy, dx) => Math.sqrt(dy * dy + dx * dx);

const along = (length, valueOf) => Float64Array.from({ length }, (_, i) => valueOf(i));

const radians = degrees => degrees * Math.PI / 180;

const SHAPES = {
  white: () => () => 1,
  spot: s => {
    const inner = s.radius * (1 - s.soft), band = Math.max(2 * s.radius * s.soft, 1);
    const reach = (inner + band) ** 2, beyond = (dy, dx) => dy * dy + dx * dx >= reach;
    return (x, y) => beyond(y - s.y, x - s.x) ? 0 : smooth((inner + band - distance(y - s.y, x - s.x)) / band);
  },
  stripe: s => {
    const normal = [Math.sin(radians(s.angle)), -Math.cos(radians(s.angle))];
    return (x, y) => clamp(s.width / 2 + 0.5 - Math.abs((x - s.x) * normal[0] + (y - s.y) * normal[1]));
  },
  sinusoid: (s, height, width) => {
    const k = 2 * Math.PI * s.cycles / Math.max(height, width), angle = radians(s.angle);
    const kx = k * Math.sin(angle), ky = k * Math.cos(angle), phase = radians(s.phase);
    // By the angles of each row and column, as a cosine for every pixel takes longer than all else.
    const [cx, sx] = [Math.cos, Math.sin].map(of => along(width, i => of(kx * i - phase)));
    const [cy, sy] = [Math.cos, Math.sin].map(of => along(height, i => of(ky * i)));
    return (x, y) => 0.5 + 0.5 * (cx[x] * cy[y] - sx[x] * sy[y]);
  },
  checkerboard: s => {
    const side = Math.max(1, Math.round(s.side)), shift = Math.round(s.shift);
    return (x, y) => (Math.floor((x + shift) / side) + Math.floor(y / side)) % 2 ? 0 : 1;
  },
  pixel: s => (x, y) => x === Math.round(s.x) && y === Math.round(s.y) ? 1 : 0,
};

export const shapeOf = (state, height, width) => SHAPES[state.kind](state, height, width);

// Projector pixels over which the brightness of a shape goes from dark to bright and on.
const FINEST = {
  white: () => Infinity,
  spot: s => s.radius,
  stripe: s => s.width,
  sinusoid: (s, height, width) => Math.max(height, width) / (2 * Math.max(s.cycles, 1)),
  checkerboard: s => s.side,
  pixel: () => 0,
};

export const finestOf = (state, height, width) => FINEST[state.kind](state, height, width);
