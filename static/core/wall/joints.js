/** The joints of the pipe: seen ones, and the places of expected ones. */

import { ROUNDING_MM } from './spans.js';

/**
 * @typedef {object} Joint
 * @property {number|null} number from the zero point, the first is 1; null when they cannot be counted
 * @property {number} distance_m
 * @property {number|null} u95_m null when it is only expected
 *
 * @typedef {object} Joints of a result of the corrections
 * @property {Joint[]} joints
 * @property {{number: number, distance_m: number}[]} expected_joints
 */

/** @param {Joint} joint */
export const isSeen = ({ u95_m: u95M }) => u95M !== null;

/**
 * @param {Joints|null} result
 * @returns {Joint[]} along the pipe
 */
export function jointsOf(result) {
  if (!result) return [];
  const expected = result.expected_joints.map((joint) => /** @type {Joint} */ ({ ...joint, u95_m: null }));
  const seen = result.joints.filter(({ number }) => number === null || number > 0);
  return [...seen, ...expected].sort((a, b) => a.distance_m - b.distance_m);
}

/**
 * Returns the last joint before a place, from which a repair crew counts in the pipe.
 * @param {Joint[]} joints along the pipe
 * @param {number} distanceM
 */
export const jointBehind = (joints, distanceM) =>
  joints.findLast(({ number, distance_m: m }) => number !== null && 1000 * m <= 1000 * distanceM + ROUNDING_MM) ?? null;
