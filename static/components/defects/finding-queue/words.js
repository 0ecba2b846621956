/** A finding in words: what it is, where, how large. */

import { rounded } from '../../../core/wall/rounding.js';
import { chainage, clockRange, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';

/** @typedef {import('../../../core/defects/findings.js').Finding} Finding */

/** The kind alone; a class of a user's model has its own name. @param {string} kind */
export const kindText = (kind) => wordFor('finding_kind', kind) ?? kind;

/** 'Crack, along the pipe'. @param {Finding} finding */
export const titleOf = ({ kind, direction }) =>
  [kindText(kind), direction && wordFor('finding_direction', direction)].filter(Boolean).join(', ');

/** '3.42 m ± 0.02 m'. @param {Finding} finding */
export const placeText = ({ distance_m: m, distance_u95_m: u95M }) =>
  [chainage(m), plusMinus(u95M)].filter(Boolean).join(' ');

/** @param {Finding} finding */
export const clockText = ({ clock, clock_to: to }) => (clock === null ? null : clockRange(clock, to));

/** '320 ± 30 mm long, 1.2 ± 0.4 mm wide'; null where nothing was measured. @param {Finding} finding */
export const sizeText = ({ length_mm: length, width_mm: width }) =>
  [length && t('findings.long', sizeOf(length)), width && t('findings.wide', sizeOf(width))]
    .filter(Boolean)
    .join(', ') || null;

/** A size with half of its 95 % interval, as precise as that is worth showing. */
const sizeOf = ({ value, high }) => {
  const decimals = value < 10 ? 1 : 0;
  return { size: rounded(value, decimals).toFixed(decimals), u95: rounded(high - value, decimals).toFixed(decimals) };
};

/** @param {number} score in [0, 1] */
export const percent = (score) => `${Math.round(100 * score)} %`;
