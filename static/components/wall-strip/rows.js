/** Where the arc of the wall lies down a strip: the whole arc, or part of it in true proportion. */

const RADIANS = Math.PI / 180;

/** Clock position of a point of the developed wall, in (0, 12]. */
export const clockAt = (arcMm, radiusMm) => (12 + 6 - arcMm / radiusMm / RADIANS / 30) % 12 || 12;

/** The developed wall at a clock position: 0 at the invert, positive to the right. */
export const arcAt = (clockH, radiusMm) => radiusMm * RADIANS * (180 - 30 * (clockH === 0 ? 12 : clockH));

/** Rows of the strip; lengths are units of 1/16 rem. */
export class Rows {
  /**
   * @param {{arc_from_mm: number, arc_to_mm: number}} layout
   * @param {number} height of the strip
   * @param {number} mmPerUnit along the axis
   * @param {number} middleMm the arc in the middle, where not all of it has room
   */
  constructor({ arc_from_mm: from, arc_to_mm: to }, height, mmPerUnit, middleMm) {
    // Near by, a millimetre is as tall as it is long; far away the whole arc fills the strip.
    this.mmPerUnit = Math.min((to - from) / height, mmPerUnit);
    const seen = this.mmPerUnit * height;
    this.middle = Math.min(Math.max(middleMm, from + seen / 2), to - seen / 2);
    this.from = this.middle - seen / 2;
    this.to = this.middle + seen / 2;
    this.isCut = seen < to - from - 1e-6;
  }

  toY(arcMm) {
    return (arcMm - this.from) / this.mmPerUnit;
  }

  toArc(y) {
    return this.from + y * this.mmPerUnit;
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
  const [first, last] = [Math.ceil(rows.from / unit / step), Math.floor(rows.to / unit / step)];
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => {
    const count = (first + i) * step;
    // Counted from the invert: 6, and 5 to the right of it.
    const text = radiusMm === null ? String(Math.abs(count)) : String((24 + 6 - count) % 12 || 12);
    return { arc: count * unit, text };
  });
}
