/** Continuous defects: A1 starts, C1 changes, B1 finishes stretch number 1. */

/**
 * @typedef {import('./observations.js').Observation} Observation
 * @typedef {{continuous: string|null, id?: string}} Part
 *
 * @typedef {object} Stretch
 * @property {string} number
 * @property {Observation} start its first observation
 * @property {number} from_m
 * @property {number} to_m
 * @property {boolean} isOpen whether it has no finish yet
 * @property {number|null} severity the worst of its observations
 */

/** Codes that say where a survey began and ended. */
const NO_DEFECTS = ['BCD', 'BCE', 'BDC'];

/**
 * Whether an observation is a defect; a start or an end is one if somebody rated it.
 * @param {{code: string|null, severity: number|null}} observation
 */
export const isDefect = ({ code, severity }) => !NO_DEFECTS.includes(code ?? '') || Boolean(severity);

/**
 * Returns the number of defects: a stretch counts once, with its start, changes and finish.
 * @param {Observation[]} observations
 */
export const defectCount = (observations) =>
  new Set(observations.filter(isDefect).map(({ id, continuous }) => continuous?.slice(1) ?? id)).size;

/**
 * Returns the stretches among some observations.
 * @param {Observation[]} observations
 * @param {number} endM where an open one ends
 * @returns {Stretch[]}
 */
export function stretchesOf(observations, endM) {
  const byNumber = Map.groupBy(
    observations.filter(({ continuous, distance_m: m }) => continuous && m !== null),
    ({ continuous }) => continuous.slice(1),
  );
  return [...byNumber].flatMap(([number, parts]) => {
    /** @param {string} role */
    const of = (role) => parts.find(({ continuous }) => continuous.startsWith(role));
    const [start, finish] = [of('A'), of('B')];
    if (!start) return [];
    const ends = [start.distance_m, finish ? finish.distance_m : Math.max(endM, start.distance_m)];
    const severities = parts.map(({ severity }) => severity ?? -1);
    const worst = Math.max(...severities);
    return [
      {
        number,
        start,
        from_m: Math.min(...ends),
        to_m: Math.max(...ends),
        isOpen: !finish,
        severity: worst < 0 ? null : worst,
      },
    ];
  });
}

/** Returns the number of the stretch that an observation belongs to, or null. @param {Part} observation */
export const stretchNumber = ({ continuous }) => (continuous ? Number(continuous.slice(1)) : null);

/**
 * Returns the role of an observation in its stretch: 'A' start, 'B' finish, 'C' change, or null.
 * @param {Part} observation
 */
export const stretchRole = ({ continuous }) => continuous?.[0] ?? null;

/**
 * Returns all observations of an observation's stretch, its start first; none without a stretch.
 * @template {Part} One
 * @param {One[]} observations
 * @param {Part} item
 */
export function partsOf(observations, item) {
  const number = stretchNumber(item);
  if (number === null) return [];
  return observations
    .filter((other) => stretchNumber(other) === number)
    .sort((a, b) => a.continuous.localeCompare(b.continuous));
}

/** Returns the stretches without a finish, the newest first. @param {Observation[]} observations */
export const openStretches = (observations) =>
  stretchesOf(observations, 0)
    .filter(({ isOpen }) => isOpen)
    .sort((a, b) => Number(b.number) - Number(a.number));

/**
 * Returns the share of a length that stretches cover; overlaps count once.
 * @param {Stretch[]} stretches
 * @param {number} lengthM
 */
export function coveredShare(stretches, lengthM) {
  if (lengthM <= 0) return 0;
  let covered = 0;
  let end = -Infinity;
  for (const { from_m: from, to_m: to } of stretches.toSorted((a, b) => a.from_m - b.from_m)) {
    covered += Math.max(0, to - Math.max(from, end));
    end = Math.max(end, to);
  }
  return Math.min(1, covered / lengthM);
}
