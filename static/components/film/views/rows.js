/** Maps the arc of the wall to rows of a strip: the whole circle of a pipe, or the whole width of a floor. */

const RADIANS = Math.PI / 180;

/** Returns the clock position of a point of the developed wall, in (0, 12]. */
export const clockAt = (arcMm, radiusMm) => (12 + 6 - arcMm / radiusMm / RADIANS / 30) % 12 || 12;

/** Returns the developed wall at a clock position: 0 at the invert, positive to the right. */
export const arcAt = (clockH, radiusMm) => radiusMm * RADIANS * (180 - 30 * (clockH === 0 ? 12 : clockH));

/** Half a mark fits between the edge of the strip and the crown: no mark moves to another hour. */
const EDGE = 12;
/** Least share of the strip for the seen part, if that is only the invert. */
const SEEN_SHARE = 0.6;

/**
 * Rows of the strip, which always shows the whole circle: a defect at the crown has a place even where the
 * camera saw only the invert. Then the seen part is enlarged, and the other hours are compressed. Lengths
 * are units of 1/16 rem.
 */
export class Rows {
  #arcs;
  #ys;

  /**
   * @param {{arc_from_mm: number, arc_to_mm: number}} layout of the seen part
   * @param {number|null} radiusMm null for a floor, whose width is that of the seen part
   * @param {number} height of the strip
   */
  constructor({ arc_from_mm: seenFrom, arc_to_mm: seenTo }, radiusMm, height) {
    const half = radiusMm === null ? 0 : Math.PI * radiusMm;
    const [from, to] = half ? [-half, half] : [seenFrom, seenTo];
    const inside = (arc) => Math.min(Math.max(arc, from), to);
    this.#arcs = [from, inside(seenFrom), inside(seenTo), to];
    const [above, seen, below] = [0, 1, 2].map((i) => this.#arcs[i + 1] - this.#arcs[i]);
    const unseen = above + below;
    const share = unseen > 0 ? Math.max(SEEN_SHARE, seen / (to - from)) : 1;
    const room = Math.max(1, height - 2 * EDGE);
    const top = EDGE + (unseen > 0 ? (room * (1 - share) * above) / unseen : 0);
    this.#ys = [EDGE, top, top + share * room, EDGE + room];
    this.from = from;
    this.to = to;
  }

  toY(arcMm) {
    return between(this.#arcs, this.#ys, arcMm);
  }

  /** Returns the arc at y; the edge is the crown, or the side of a floor. */
  toArc(y) {
    return Math.min(Math.max(between(this.#ys, this.#arcs, y), this.from), this.to);
  }
}

/** Interpolates at `at` between knots whose places rise, some of them equal. */
function between(places, values, at) {
  let i = 0;
  while (i < places.length - 2 && (at > places[i + 1] || places[i] === places[i + 1])) i += 1;
  while (i > 0 && places[i] === places[i + 1]) i -= 1;
  const share = (at - places[i]) / (places[i + 1] - places[i]);
  return values[i] + share * (values[i + 1] - values[i]);
}

/**
 * Returns a closed line on the wall as open lines, cut where it passes the crown: there the strip ends
 * below and begins above.
 * @param {{mm: number, arc: number}[]} points
 * @param {number|null} radiusMm null for a floor, which has no crown
 */
export function cutAtCrown(points, radiusMm) {
  const half = radiusMm === null ? Infinity : Math.PI * radiusMm;
  const lines = [[points[0]]];
  for (const next of [...points.slice(1), points[0]]) {
    const last = lines.at(-1).at(-1);
    if (Math.abs(next.arc - last.arc) > half) {
      const side = Math.sign(last.arc);
      const share = (half - Math.abs(last.arc)) / (2 * half - Math.abs(last.arc) - Math.abs(next.arc) || 1);
      const mm = last.mm + share * (next.mm - last.mm);
      lines.at(-1).push({ mm, arc: side * half });
      lines.push([{ mm, arc: -side * half }]);
    }
    lines.at(-1).push(next);
  }
  return lines;
}

/** Hours of the circle from the invert, the most important first. */
const HOURS = [0, -6, 6, -3, 3, -1, 1, -2, 2, -4, 4, -5, 5];
const MM_APART = [10, 20, 50, 100, 200, 500, 1000, 2000];

/**
 * Returns labelled rows: whole hours of a pipe where they have room, mm beside the axis of a floor.
 * @param {Rows} rows
 * @param {number|null} radiusMm null for a floor
 * @param {number} atLeast units between two of them
 * @returns {{arc: number, text: string}[]}
 */
export const rowMarks = (rows, radiusMm, atLeast) =>
  radiusMm === null ? marksOfFloor(rows, atLeast) : marksOfPipe(rows, radiusMm, atLeast);

function marksOfPipe(rows, radiusMm, atLeast) {
  const marks = [];
  for (const count of HOURS) {
    const arc = count * radiusMm * RADIANS * 30;
    const hasRoom = marks.every((other) => Math.abs(rows.toY(other.arc) - rows.toY(arc)) >= atLeast);
    // Counted from the invert: 6, and 5 to the right of it.
    if (hasRoom) marks.push({ arc, text: String((24 + 6 - count) % 12 || 12) });
  }
  return marks;
}

function marksOfFloor(rows, atLeast) {
  const perMm = rows.toY(1) - rows.toY(0);
  const step = MM_APART.find((size) => size * perMm >= atLeast) ?? MM_APART.at(-1);
  const [first, last] = [Math.ceil(rows.from / step), Math.floor(rows.to / step)];
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => {
    const arc = (first + i) * step;
    return { arc, text: String(Math.abs(arc)) };
  });
}
