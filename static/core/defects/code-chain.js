/** A code typed letter by letter, B-A-B-B-A: each letter narrows what may follow. */

/**
 * @typedef {import('./codes.js').CodeRow} CodeRow
 *
 * @typedef {object} Choice what may be typed next
 * @property {string} letter
 * @property {string} label what the code means from then on
 *
 * @typedef {object} Typed
 * @property {string} letters all that are typed, and those that were the only ones that could follow
 * @property {CodeRow|null} row the code that the letters spell, null before that
 * @property {Choice[]} choices
 */

/**
 * @param {CodeRow[]} rows main codes, and full ones
 * @param {string} text typed letters
 * @returns {Typed}
 */
export function typedSoFar(rows, text) {
  let letters = text;
  let follows;
  for (;;) {
    const fits = rows.filter((row) => row.letters.startsWith(letters));
    follows = Map.groupBy(
      fits.filter((row) => row.letters.length > letters.length),
      (row) => row.letters[letters.length],
    );
    const isCode = fits.some((row) => row.letters === letters);
    if (isCode || follows.size !== 1) break;
    letters += [...follows.keys()][0];
  }
  const row = rows.find((other) => other.letters === letters) ?? null;
  const choices = [...follows].map(([letter, group]) => ({ letter, label: meaning(group, row) }));
  return { letters, row, choices };
}

/**
 * Returns what a group of rows has in common, without what the code so far says already.
 * @param {CodeRow[]} group
 * @param {CodeRow|null} row
 */
function meaning(group, row) {
  const [title] = group[0].label.split(':');
  if (!row) return [...new Set(group.map(({ label }) => label.split(':')[0]))].join(', ') || title;
  const details = group.map(({ label }) => (label.split(': ')[1] ?? label).split(', '));
  const [first] = details;
  const end = first.findIndex((part, i) => details.some((other) => other[i] !== part));
  const common = end < 0 ? first : first.slice(0, Math.max(end, 1));
  const known = row.label.split(': ')[1]?.split(', ') ?? [];
  return common.filter((part) => !known.includes(part)).join(', ') || common.join(', ');
}

/** Hours that are being typed, each after an at sign: 3, 10, 01, 9 and 3; a lone 1 may become 10, 11 or 12. */
const HOUR = '(?:0[1-9]?|1[0-2]?|[2-9])';
const CLOCK = new RegExp(`^@(?:${HOUR}(?:@${HOUR}?)?)?$`);

/** Whether a clock position that is being typed may begin like this. @param {string} text */
export const isClock = (text) => CLOCK.test(text);

/**
 * Returns the hours of a typed clock position.
 * @param {string} text
 * @returns {{clock_from: number|null, clock_to: number|null}}
 */
export function hoursOf(text) {
  const [from = null, to = null] = text
    .split('@')
    .map(Number)
    .filter((hour) => hour > 0);
  return { clock_from: from, clock_to: to };
}

/**
 * Returns the codes of the last tags, the newest first, each once.
 * @param {import('./observations.js').Observation[]} observations
 * @param {number} most
 */
export function lastCodes(observations, most) {
  /** @param {import('./observations.js').Observation} item */
  const numberOf = ({ seq }) => seq ?? Number.MAX_SAFE_INTEGER; // one that the server has not numbered yet is newer than all
  const newestFirst = observations
    .filter(({ code }) => code)
    .reverse()
    .sort((a, b) => numberOf(b) - numberOf(a));
  const found = new Map();
  for (const item of newestFirst) {
    if (found.size === most) break;
    const { code, char1 = null, char2 = null, severity = null, quant1 = null, quant2 = null } = item;
    const key = [code, char1, char2, severity].join(' ');
    if (!found.has(key)) found.set(key, { code, char1, char2, severity, quant1, quant2 });
  }
  return [...found.values()];
}
