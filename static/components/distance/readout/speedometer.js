/** Speed of the robot at the shown frame, in m/min. */

const WINDOW_S = 1;
/** How long a value is shown: a number that changes with every picture cannot be read. */
const SHOWN_FOR_S = 0.3;

const mPerMin = (from, to) =>
  to.time_s > from.time_s ? (Math.abs(to.distance_mm - from.distance_mm) / (to.time_s - from.time_s)) * 0.06 : null;

/** Speed in the consecutive pictures of a live run. */
export class Speedometer {
  /** null until it is known */
  value = null;

  #rows = [];
  #readAtS = -Infinity;

  /** @param {import('../../../core/survey/track.js').Row} row */
  add(row) {
    const last = this.#rows.at(-1);
    if (last && (row.time_s < last.time_s || row.time_s > last.time_s + WINDOW_S)) this.clear();
    this.#rows.push(row);
    while (this.#rows[0].time_s < row.time_s - WINDOW_S) this.#rows.shift();
    if (row.time_s < this.#readAtS + SHOWN_FOR_S) return;
    this.#readAtS = row.time_s;
    this.value = mPerMin(this.#rows[0], row);
  }

  clear() {
    this.#rows = [];
    this.#readAtS = -Infinity;
    this.value = null;
  }
}

/**
 * Returns the speed at a frame of a track, over a second around it.
 * @param {import('../../../core/survey/track.js').Track} track
 * @param {import('../../../core/survey/track.js').Row} row
 */
export function speedAt(track, row) {
  const ends = [-WINDOW_S / 2, WINDOW_S / 2].map((s) => track.row(track.frameAt(row.time_s + s)));
  return ends[0] && ends[1] ? mPerMin(...ends) : null;
}
