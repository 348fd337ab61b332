// Ranges of figures { low, high, isLog }, of which what is left out is automatic.

const LOG_DECADES = 3;
const isEnd = value => value === undefined || Number.isFinite(value);

// Ranges that an address gives: by the name of a figure { low, high, isLog }, each of which may be left out.
export function readRanges(given) {
  if (!given || typeof given !== 'object' || Array.isArray(given)) return {};
  return Object.fromEntries(Object.entries(given).slice(0, 50).flatMap(([name, range]) => {
    if (!/^[a-z-]{1,40}$/.test(name) || !range || !isEnd(range.low) || !isEnd(range.high)) return [];
    const { low, high } = range, isLog = typeof range.isLog === 'boolean' ? range.isLog : undefined;
    return [[name, withoutUndefined({ low, high, isLog })]];
  }));
}

export const withoutUndefined = object => Object.fromEntries(Object.entries(object).filter(([, value]) => value !== undefined));

// The range of what is typed, and of automatic ends { low, high } in place of the rest.
export function resolve({ low, high, isLog }, automatic) {
  let bottom = low ?? automatic.low, top = high ?? automatic.high;
  if (isLog && !(top > 0)) top = bottom > 0 ? 10 * bottom : 1;
  if (isLog && !(bottom > 0)) bottom = top / 10 ** LOG_DECADES;
  // An automatic end gives way to one that was typed.
  if (bottom >= top && high === undefined) top = isLog ? 10 * bottom : bottom + 1;
  else if (bottom >= top) bottom = isLog ? top / 10 : top - 1;
  return { low: bottom, high: top, isLog: Boolean(isLog) };
}

// What is wrong with a range that was typed; '' for nothing. isSymmetric: it goes from -high to high.
export function faultOf({ low, high, isLog }, isSymmetric) {
  const typed = [low, high].filter(value => value !== undefined);
  if (!typed.every(Number.isFinite)) return 'Type a number, or leave it empty.';
  if (low >= high) return 'The first number must be below the second.';
  if (isLog && typed.some(value => value <= 0)) return 'A logarithmic scale has numbers above 0 only.';
  return isSymmetric && high <= 0 ? 'Type a number above 0.' : '';
}
