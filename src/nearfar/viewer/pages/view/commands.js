// The command line and the Python that make the page's picture.

import { pictureName } from './file-names.js';
import { lightFile } from './saving.js';
import { gainsOf, hasPart, isFree, SPLITS } from './state.js';

const quoted = text => /^[\w.,:=+-]+$/u.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;
const literal = text => JSON.stringify(text);

// Gains that are not 1, by the names that nearfar has for them.
function changedGains(scene, state, split) {
  const values = gainsOf(state, split);
  return SPLITS[split].map((part, i) => [part === 'far' && isFree(scene) ? 'free' : part, values[i], part])
    .filter(([, value, part]) => value !== 1 && hasPart(scene, part));
}

// What the page shows, as the other tools are told of it.
export function describe(page) {
  const { scene, store: { state }, scenePictures: { split }, otherProjectors } = page, own = { transport: scene.name, light: lightFile(page) };
  // Of several projectors: those that are lit, of the relit scene alone.
  const lit = state.tool === 'relit' ? [...(otherProjectors.isLit ? [own] : []), ...otherProjectors.files] : [], [first = own, ...others] = lit;
  const { exposure, gamma, channel, tool, range, reach, broad } = state;
  return {
    ...first, others, output: `${pictureName(page)}.png`, exposure, gamma, split,
    channel: channel ? ['red', 'green', 'blue'].indexOf(channel) : null, gains: tool === 'reach' ? [] : changedGains(scene, state, split),
    mask: tool === 'reach' ? { within: [reach], ring: [reach, reach + broad], beyond: [reach] }[range] : null, range,
  };
}

const look = ({ exposure, gamma, channel }) => [
  ...(exposure ? ['--exposure', String(exposure)] : []), ...(gamma === 1 ? [] : ['--gamma', String(gamma)]),
  ...(channel === null ? [] : ['--channel', ['red', 'green', 'blue'][channel]]),
];

export function commandOf(shown, light = quoted(shown.light), output = quoted(shown.output)) {
  const { transport, gains, mask, range, others } = shown;
  const words = mask ? ['probe', quoted(transport), output, '--light', light, `--${range}`, mask.join(':')]
    : ['relight', quoted(transport), light, output, ...gains.flatMap(([name, value]) => ['--gain', `${name}=${value}`]), ...others.flatMap(other => ['--and', quoted(`${other.transport}=${other.light}`)])];
  return ['nearfar', ...words, ...look(shown)].join(' ');
}

// The pictures of the lights that a film's ZIP has, once more.
export const loopOf = shown => `for light in lights/*.png; do
  ${commandOf({ ...shown, mask: null }, '"$light"', '"relit-$(basename "$light")"')}
done`;

export function pythonOf(shown) {
  return shown.others.length ? pythonOfSeveral(shown) : pythonOfOne(shown);
}

function pythonOfSeveral(shown) {
  const { transport, light, others, output } = shown, { made, developed } = calls(shown);
  const pairs = [{ transport, light }, ...others].map(each => `    (${literal(each.transport)}, ${literal(each.light)}),`).join('\n');
  return `from pathlib import Path

import nearfar
from nearfar.files import ${developed.length ? 'developed, ' : ''}read_light, write_picture
from nearfar.transport.colour import as_channels_see

picture = 0
for name, file in (
${pairs}
):
    transport = nearfar.load_transport(name)
    light = read_light(Path(file), transport.projector)
    light = as_channels_see(light, transport.channels, transport.provenance)
    picture = picture + ${made}
${developed.length ? `picture = developed(picture, ${developed.join(', ')})\n` : ''}write_picture(Path(${literal(output)}), picture)
`;
}

// What makes the picture, and how it is developed.
function calls({ gains, mask, range, split, exposure, gamma, channel }) {
  const given = gains.map(([name, value]) => `, ${name}=${value}`).join('');
  const made = mask ? `nearfar.probe(transport, light, nearfar.ProbingMask.${range}(${mask.join(', ')}))`
    : split === 'physical' && gains.length ? `nearfar.split_physically(transport).relight(light${given})` : `transport.relight(light${given})`;
  const developed = [...(exposure ? [`exposure=${exposure}`] : []), ...(gamma === 1 ? [] : [`gamma=${gamma}`]), ...(channel === null ? [] : [`channel=${channel}`])];
  return { made, developed };
}

function pythonOfOne(shown) {
  const { transport, light, output } = shown, { made, developed } = calls(shown);
  return `from pathlib import Path

import nearfar
from nearfar.files import ${developed.length ? 'developed, ' : ''}read_light, write_picture
from nearfar.transport.colour import as_channels_see

transport = nearfar.load_transport(${literal(transport)})
light = read_light(Path(${literal(light)}), transport.projector)
light = as_channels_see(light, transport.channels, transport.provenance)
picture = ${made}
${developed.length ? `picture = developed(picture, ${developed.join(', ')})\n` : ''}write_picture(Path(${literal(output)}), picture)
`;
}
