// The fields in which the range of a figure is typed.

const SCALES = [['linear', false], ['logarithmic', true]];

const element = (name, properties) => Object.assign(document.createElement(name), properties);

function labelled(text, field) {
  const label = element('label', {});
  label.append(element('span', { textContent: text }), field);
  return label;
}

function endField(end) {
  const input = element('input', { type: 'text', inputMode: 'decimal', placeholder: 'automatic', autocomplete: 'off' });
  input.dataset.end = end;
  return input;
}

function choice(name, value, options) {
  const select = element('select', {});
  select.dataset[name] = value;
  select.append(...options);
  return select;
}

// Builds the fields of a place by its data: isSymmetric, a range from -high to high in colours of its own; isLinear, no
// logarithmic scale; isLog, that scale unless another one is chosen.
export function buildFields(place, maps) {
  const { isSymmetric, isLinear, isLog, title } = place.dataset, isPlain = isSymmetric === undefined;
  const texts = isPlain ? [['low', 'from'], ['high', 'to']] : [['high', 'at most ±']];
  const fields = { ends: texts.map(([end]) => [end, endField(end)]) };
  const body = element('div', { className: 'typed' });
  body.append(...fields.ends.map(([, input], i) => labelled(texts[i][1], input)));
  if (isPlain && isLinear === undefined) {
    fields.scale = choice('scale', String(isLog !== undefined), SCALES.map(([text, value]) => new Option(text, String(value))));
    body.append(labelled('scale', fields.scale));
  }
  if (isPlain) {
    fields.colours = choice('colours', '', maps.map(({ name }) => new Option(name, name)));
    body.append(labelled('colours', fields.colours));
  }
  const button = element('button', { textContent: 'automatic' }), details = element('details', {});
  body.append(button, element('span', { role: 'status' }));
  details.append(element('summary', { textContent: `${title ? `${title}: ` : ''}${isPlain ? 'range and colours' : 'range'}` }), body);
  place.append(details);
  return { fields, button };
}
