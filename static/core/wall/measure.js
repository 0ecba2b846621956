/**
 * Sizes on the wall between clicked points, as the server derives them (vo_core/geometry/measure.py): at
 * once while a person points. The server adds the interval, and its figure is the one that counts.
 */

import { post } from '../server/api.js';
import { rounded } from './rounding.js';

/** Number of points of each kind. */
export const KINDS = {
  length: { least: 2, most: 40 },
  width: { least: 2, most: 2 },
  area: { least: 3, most: 40 },
  gap: { least: 2, most: 2 },
  step: { least: 2, most: 2 },
  depth: { least: 2, most: 2 },
};
export const MOST_MEASURES = 8;

/**
 * Codes of EN 13508-2 whose first quantity is no length along the wall; '' for any characterisation.
 * @type {Record<string, Record<string, Measure['kind']>>}
 */
const KIND_OF_CODE = { BAB: { '': 'width' }, BAJ: { A: 'gap', B: 'step' }, BAG: { '': 'step' }, BAI: { '': 'step' } };

/**
 * @typedef {Api['MeasurePoint']} Point
 * @typedef {Api['Measure']} Measure
 * @typedef {Omit<Api['MeasuredOut'], 'u95'> & {u95: number|null}} Figure `u95` is null where only the page has measured
 * @typedef {{at: import('./wall.js').Vector, from: import('./wall.js').Vector}} Sight wall point and camera, [along, right, down] in mm
 */

/**
 * Returns the kind that the code's quantity most likely is.
 * @param {{code?: string|null, char1?: string|null}} tag
 * @param {{unit_q1?: string|null}|null} rules
 * @returns {Measure['kind']}
 */
export function usualKind({ code, char1 }, rules) {
  const kinds = KIND_OF_CODE[code];
  const known = kinds?.[char1 ?? ''] ?? kinds?.[''];
  if (known) return known;
  return rules?.unit_q1 === '%' ? 'depth' : 'length';
}

/**
 * Measures what the page knows of some points; null where it cannot.
 * @param {Measure['kind']} kind
 * @param {(Sight|null)[]} sights
 * @param {number|null} radius of the pipe, null on a floor
 * @returns {Figure|null}
 */
export function measured(kind, sights, radius) {
  if (sights.length < KINDS[kind].least || sights.includes(null)) return null;
  if (kind === 'depth' && radius === null) return null;
  const share = kind === 'depth' ? fillShare(sights) : null;
  const value = share === null ? SIZE[/** @type {keyof typeof SIZE} */ (kind)](sights, radius) : 2 * radius * share;
  if (!Number.isFinite(value)) return null;
  const percent = share === null ? null : 100 * share;
  return { value, u95: null, unit: kind === 'area' ? 'mm2' : 'mm', percent, percent_u95: null };
}

/**
 * Returns the server's figure.
 * @param {string} inspection
 * @param {Measure} measure
 * @param {AbortSignal} [signal]
 * @returns {Promise<Figure>}
 */
export const measuredByServer = (inspection, measure, signal) =>
  post(`/api/inspections/${inspection}/measure`, measure, signal);

/** @type {Record<Exclude<Measure['kind'], 'depth'>, (sights: Sight[], radius: number|null) => number>} */
const SIZE = {
  length: lengthOf,
  width: lengthOf,
  area(sights, radius) {
    const points = developed(sights, radius);
    const twice = points.reduce((sum, [x, y], i) => {
      const [nextX, nextY] = points[(i + 1) % points.length];
      return sum + x * nextY - nextX * y;
    }, 0);
    return Math.abs(twice) / 2;
  },
  gap: ([one, other]) => Math.abs(other.at[0] - one.at[0]),
  /** The ray to the edge meets the section across the pipe through the first point. */
  step([section, { at, from }], radius) {
    const share = (section.at[0] - from[0]) / (at[0] - from[0]);
    const [right, down] = [1, 2].map((k) => from[k] + share * (at[k] - from[k]));
    return radius === null ? -down : radius - Math.hypot(right, down);
  },
};

/** @param {Sight[]} sights @param {number|null} radius */
function lengthOf(sights, radius) {
  const points = developed(sights, radius);
  return points.slice(1).reduce((sum, [x, y], i) => sum + Math.hypot(x - points[i][0], y - points[i][1]), 0);
}

/**
 * Returns points along the pipe and along the arc, each the short way round from the one before.
 * @param {Sight[]} sights
 * @param {number|null} radius
 * @returns {[number, number][]}
 */
function developed(sights, radius) {
  if (radius === null) return sights.map(({ at: [along, right] }) => [along, right]);
  /** @type {number|null} */
  let before = null;
  return sights.map(({ at: [along, right, down] }) => {
    let angle = Math.atan2(right, down);
    if (before !== null) angle -= 2 * Math.PI * Math.round((angle - before) / (2 * Math.PI));
    before = angle;
    return [along, radius * angle];
  });
}

/** @param {Sight[]} sights */
function fillShare([one, other]) {
  const [left, right] = [one, other].map(({ at: [, y, z] }) => Math.atan2(y, z));
  return (1 - Math.cos((right - left) / 2)) / 2;
}

/** Rounds a size as it is shown: a tenth below 10. @param {number} value */
export const shownSize = (value) => rounded(value, Math.abs(value) < 10 ? 1 : 0);

/**
 * Returns a size as the quantity of a code, null where the unit does not fit.
 * @param {Measure['kind']} kind
 * @param {Figure} figure
 * @param {string|null} unit of the quantity
 * @param {number|null} radius of the pipe
 */
export function quantityOf(kind, { value, percent }, unit, radius) {
  if (unit === 'mm' && kind !== 'area') return shownSize(Math.abs(value));
  if (unit !== '%' || radius === null) return null;
  if (percent !== null) return shownSize(percent);
  // What sticks into a pipe is stated as a share of its diameter.
  return kind === 'step' ? shownSize((50 * Math.abs(value)) / radius) : null;
}
