/** Where the arc of the wall lies down a strip: the whole circle of a pipe, or the whole breadth of a floor. */

const RADIANS = Math.PI / 180;

/** Clock position of a point of the developed wall, in (0, 12]. */
export const clockAt = (arcMm, radiusMm) => (12 + 6 - arcMm / radiusMm / RADIANS / 30) % 12 || 12;

/** The developed wall at a clock position: 0 at the invert, positive to the right. */
export const arcAt = (clockH, radiusMm) => radiusMm * RADIANS * (180 - 30 * (clockH === 0 ? 12 : clockH));

/** Half a mark fits between the edge of the strip and the crown: no mark is moved to another hour. */
const EDGE = 12;

/**
 * Rows of the strip, which always holds the whole circle, also where the camera saw no more than the
 * invert: a defect at the crown has its place. Lengths are units of 1/16 rem.
 */
export class Rows {
  /**
   * @param {{arc_from_mm: number, arc_to_mm: number}} layout of what was seen
   * @param {number|null} radiusMm null for a floor, which is as broad as was seen
   * @param {number} height of the strip
   */
  constructor({ arc_from_mm: from, arc_to_mm: to }, radiusMm, height) {
    const half = radiusMm === null ? 0 : Math.PI * radiusMm;
    this.from = half ? -half : from;
    this.to = half || to;
    this.mmPerUnit = (this.to - this.from) / Math.max(1, height - 2 * EDGE);
  }

  toY(arcMm) {
    return EDGE + (arcMm - this.from) / this.mmPerUnit;
  }

  /** The edge belongs to the crown, or to the side of a floor. */
  toArc(y) {
    return Math.min(Math.max(this.from + (y - EDGE) * this.mmPerUnit, this.from), this.to);
  }
}

const HOURS_APART = [1, 3, 6];
const MM_APART = [10, 20, 50, 100, 200, 500, 1000, 2000];

/**
 * Labelled rows: whole hours of a pipe, mm beside the axis of a floor.
 * @param {Rows} rows
 * @param {number|null} radiusMm null for a floor
 * @param {number} atLeast units between two of them
 * @returns {{arc: number, text: string}[]}
 */
export function rowMarks(rows, radiusMm, atLeast) {
  const unit = radiusMm === null ? 1 : radiusMm * RADIANS * 30;
  const steps = radiusMm === null ? MM_APART : HOURS_APART;
  const step = steps.find((size) => (size * unit) / rows.mmPerUnit >= atLeast) ?? steps.at(-1);
  const [first, last] = [Math.ceil(rows.from / unit / step - 1e-6), Math.floor(rows.to / unit / step + 1e-6)];
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => {
    const count = (first + i) * step;
    // Counted from the invert: 6, and 5 to the right of it.
    const text = radiusMm === null ? String(Math.abs(count)) : String((24 + 6 - count) % 12 || 12);
    return { arc: count * unit, text };
  });
}
