/** Maps distances of one run to those of another run of the same culvert. */

/**
 * @typedef {object} Alignment
 * @property {(mm: number) => number} toA a distance of run B, as one of run A
 * @property {(mm: number) => number} toB
 */

/**
 * By distance alone.
 * @param {boolean} isReversed whether B came from the other end
 * @param {number} lengthMm of the culvert, for a reversed run
 * @returns {Alignment}
 */
export function byDistance(isReversed, lengthMm) {
  const turn = (mm) => (isReversed ? lengthMm - mm : mm);
  return { toA: turn, toB: turn };
}

/**
 * By the places that were recognised on both walls; between and beyond them a run goes on evenly.
 * @param {import('../../../core/wall/wall-map.js').WallMap} map of A, the earlier run, and B
 * @returns {Alignment}
 */
export function byWalls({ ties, sign }) {
  const rising = ties.toSorted((one, other) => one.earlier - other.earlier);
  const [a, b] = [rising.map(({ earlier }) => earlier), rising.map(({ later }) => sign * later)];
  return {
    toA: (mm) => along(b, a, sign * mm),
    toB: (mm) => sign * along(a, b, mm),
  };
}

/** Piecewise linear from the places `from` to the places `to`; beyond them shifted by a constant. */
function along(from, to, mm) {
  if (mm <= from[0]) return to[0] + mm - from[0];
  const next = from.findIndex((place) => place > mm);
  if (next < 0) return to.at(-1) + mm - from.at(-1);
  const share = (mm - from[next - 1]) / (from[next] - from[next - 1]);
  return to[next - 1] + share * (to[next] - to[next - 1]);
}
