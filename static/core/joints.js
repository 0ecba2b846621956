/** The joints of the pipe: as the corrections found them, else where the unit length puts them. */

/**
 * @typedef {object} Joint
 * @property {number} number from the zero point, the first is 1
 * @property {number} distance_m
 * @property {number|null} u95_m null when it is only expected there
 */

/**
 * @param {{joints: Joint[]}|null} result of the corrections
 * @param {number} endMm how far joints are expected
 * @param {number|null} unitMm length of a pipe unit, null when it is not known
 * @returns {Joint[]}
 */
export function jointsOf(result, endMm, unitMm) {
  if (result?.joints.length) return result.joints;
  if (!unitMm) return [];
  return Array.from({ length: Math.max(0, Math.floor(endMm / unitMm)) }, (_, i) => ({
    number: i + 1,
    distance_m: ((i + 1) * unitMm) / 1000,
    u95_m: null,
  }));
}
