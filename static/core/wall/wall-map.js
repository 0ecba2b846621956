/** Which place of an earlier wall is which place of a later one, as the server found by their pictures. */

/**
 * @typedef {Api['ChangesOut']} Changes
 *
 * @typedef {object} Tie a place that was recognised on both walls, in mm
 * @property {number} later
 * @property {number} earlier
 * @property {number} arc what is added to the arc of the later wall, to its negative where that was driven the other way
 * @property {number} u95
 *
 * @typedef {{from: Tie, to: Tie}} Piece a part between two ties, straight on both walls
 * @typedef {{from: number, to: number, reason: string}} Gap a part of the earlier wall without a place on the later one, in mm
 */

const U95 = 1.96;

export class WallMap {
  /** 1, or -1 where the later camera came from the other end. @type {1|-1} */
  sign;
  /** All places that were recognised, along the later wall. @type {Tie[]} */
  ties;
  /** Along the later wall. @type {Piece[]} */
  pieces;

  #gaps;

  /** @param {Pick<Changes, 'direction'|'map'|'gaps'>} changes */
  constructor({ direction, map, gaps }) {
    this.sign = direction === 'opposite' ? -1 : 1;
    this.#gaps = gaps.map(({ from_m: from, to_m: to, reason }) => ({ from: 1000 * from, to: 1000 * to, reason }));
    const stretches = [...Map.groupBy(map, ({ stretch }) => stretch).values()].map((points) =>
      points.map(tieOf).sort(alongLater),
    );
    this.ties = stretches.flat().sort(alongLater);
    this.pieces = stretches.flatMap((ties) => this.#withEnds(ties)).sort((a, b) => alongLater(a.from, b.from));
  }

  /** A stretch holds up to the gaps beside it. @param {Tie[]} ties @returns {Piece[]} */
  #withEnds(ties) {
    const [first, last] = [ties[0], ties[ties.length - 1]];
    const before = Math.max(...this.#gaps.map(({ to }) => to).filter((to) => to <= first.later), -Infinity);
    const after = Math.min(...this.#gaps.map(({ from }) => from).filter((from) => from >= last.later), Infinity);
    const all = [this.#moved(first, before), ...ties, this.#moved(last, after)];
    return all.slice(1).map((to, i) => ({ from: all[i], to }));
  }

  /** @param {Tie} tie @param {number} later @returns {Tie} */
  #moved(tie, later) {
    return Number.isFinite(later) ? { ...tie, later, earlier: tie.earlier + this.sign * (later - tie.later) } : tie;
  }

  /**
   * Returns where the map does not hold, along the earlier wall, with the reason that the later one gives.
   * @param {number} low ends of the earlier wall in mm
   * @param {number} high
   * @returns {Gap[]}
   */
  gapsWithin(low, high) {
    const held = this.pieces
      .map((piece) => ({ piece, ends: [piece.from.earlier, piece.to.earlier].sort((a, b) => a - b) }))
      .sort((a, b) => a.ends[0] - b.ends[0] || a.ends[1] - b.ends[1]);
    const edges = [low, ...held.flatMap(({ ends }) => ends), high];
    /** @type {Gap[]} */
    const gaps = [];
    for (let i = 0; i < edges.length; i += 2) {
      const beside = held[Math.min(i / 2, held.length - 1)]?.piece;
      if (edges[i + 1] - edges[i] > 1)
        gaps.push({ from: edges[i], to: edges[i + 1], reason: this.#reasonBeside(beside) });
    }
    return gaps;
  }

  /** @param {Piece|undefined} piece the one after the gap, or the last one */
  #reasonBeside(piece) {
    /** @param {{from: number, to: number}} gap */
    const away = ({ from, to }) =>
      piece ? Math.min(Math.abs(from - piece.to.later), Math.abs(to - piece.from.later)) : 0;
    return this.#gaps.toSorted((a, b) => away(a) - away(b))[0]?.reason ?? 'unseen';
  }
}

/** @param {Changes['map'][0]} point @returns {Tie} */
const tieOf = ({ distance_m: later, earlier_distance_m: earlier, arc_mm: arc, sigma_mm: sigma }) => ({
  later: 1000 * later,
  earlier: 1000 * earlier,
  arc,
  u95: U95 * sigma,
});

/** @param {Tie} a @param {Tie} b */
const alongLater = (a, b) => a.later - b.later;
