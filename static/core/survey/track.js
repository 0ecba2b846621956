/**
 * The track of one inspection: presentation time and pose of every frame. The times are the PTS table of
 * the video: a picture is found by its time, never by time * fps.
 */

import { RunColumns } from '../page/columns.js';

/** How a frame was tracked, by its value in the column `status`. */
export const STATUSES = ['ok', 'weak', 'lost'];

/** What the distance of a frame rests on, by its value in the column `source`. */
export const SOURCES = ['odometry', 'joint', 'closure', 'counter', 'bridged', 'typed'];

/** The sources that need no word wherever a distance is shown. */
export const BY_CAMERA = new Set(['odometry', 'joint', 'closure']);

const TYPES = {
  time_s: Float64Array,
  x_mm: Float64Array,
  distance_mm: Float64Array,
  y_mm: Float32Array,
  z_mm: Float32Array,
  yaw_deg: Float32Array,
  pitch_deg: Float32Array,
  roll_deg: Float32Array,
  sigma_distance_mm: Float32Array,
  quality: Float32Array,
  status: Uint8Array,
  looking_around: Uint8Array,
  source: Uint8Array,
};
const COLUMNS = Object.keys(TYPES);
/** The server places the parts of a film whose time stamps begin anew so many seconds apart; see `vo_core.timeline`. */
const SEAM_S = [10, 11];
/** Browsers round media times to microseconds. */
const ROUNDING_S = 0.0005;
/** Distances of passes from a place that differ less than this count as equal. */
const SAME_PLACE_MM = 5;

/**
 * @typedef {object} Row
 * @property {number} frame
 * @property {number} time_s
 * @property {number} x_mm
 * @property {number} y_mm
 * @property {number} yaw_deg
 * @property {number} distance_mm
 * @property {number} sigma_distance_mm
 * @property {number} quality
 * @property {'ok'|'weak'|'lost'} status
 * @property {number} z_mm
 * @property {number} pitch_deg
 * @property {number} roll_deg
 * @property {string} source one of `SOURCES`
 * @property {number} looking_around 1 while the robot stands and its camera looks around
 */

export class Track extends RunColumns {
  /** Least distance of the first `#ranged` rows. */
  #low = Infinity;
  #high = -Infinity;
  #ranged = 0;
  /** Whether the time stamps begin anew within the first `#compared` rows. */
  #beginsAnew = false;
  #compared = 1;

  /** @param {string} inspection */
  constructor(inspection) {
    super(`/api/inspections/${inspection}/track?format=columns`, TYPES);
  }

  /** The least and the greatest distance in mm, 0 without a track. */
  get range() {
    const distances = this.column('distance_mm');
    for (; this.#ranged < distances.length; this.#ranged += 1) {
      const mm = distances[this.#ranged];
      if (mm < this.#low) this.#low = mm;
      if (mm > this.#high) this.#high = mm;
    }
    return this.#low <= this.#high ? { low: this.#low, high: this.#high } : { low: 0, high: 0 };
  }

  /** Whether the time stamps of the film begin anew somewhere. */
  get beginsAnew() {
    const times = this.column('time_s');
    const [least, most] = SEAM_S;
    for (; !this.#beginsAnew && this.#compared < times.length; this.#compared += 1) {
      const gapS = times[this.#compared] - times[this.#compared - 1];
      this.#beginsAnew = gapS >= least && gapS < most;
    }
    return this.#beginsAnew;
  }

  /** @returns {Row|null} @param {number} frame */
  row(frame) {
    if (!(frame >= 0 && frame < this.length)) return null;
    /** @type {any} */
    const row = { frame };
    for (const name of COLUMNS) row[name] = this.column(name)[frame];
    row.status = STATUSES[row.status];
    row.source = SOURCES[row.source];
    return row;
  }

  began() {
    [this.#low, this.#high, this.#ranged] = [Infinity, -Infinity, 0];
    [this.#beginsAnew, this.#compared] = [false, 1];
  }

  /** Returns the frame on screen at this media time; -1 without a track. @param {number} timeS */
  frameAt(timeS) {
    const times = this.column('time_s');
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= timeS + ROUNDING_S) low = middle + 1;
      else high = middle;
    }
    return Math.max(low - 1, Math.min(0, times.length - 1));
  }

  /**
   * Returns where to seek for this frame: within its interval, as its very start may show the previous one.
   * @param {number} frame
   * @param {number} share of the interval, from its start
   */
  seekTime(frame, share = 0.5) {
    const times = this.column('time_s');
    const isLast = frame + 1 >= times.length;
    const [from, to] = isLast ? [frame - 1, frame] : [frame, frame + 1];
    return times[frame] + share * (frame > 0 || !isLast ? times[to] - times[from] : 0);
  }

  /**
   * Returns the frame nearest to a distance; of several passes (the robot reversed), the one nearest to
   * `frame`.
   * @param {number} distanceMm
   * @param {number} frame
   */
  frameAtDistance(distanceMm, frame) {
    const distances = this.column('distance_mm');
    let nearest = Infinity;
    for (const distance of distances) nearest = Math.min(nearest, Math.abs(distance - distanceMm));
    const tolerance = nearest + SAME_PLACE_MM;
    let best = -1;
    let passing = -1; // the nearest frame of the pass that contains `i`
    for (let i = 0; i <= distances.length; i += 1) {
      const apart = i < distances.length ? Math.abs(distances[i] - distanceMm) : Infinity;
      if (apart <= tolerance) {
        if (passing < 0 || apart < Math.abs(distances[passing] - distanceMm)) passing = i;
      } else if (passing >= 0) {
        if (best < 0 || Math.abs(passing - frame) < Math.abs(best - frame)) best = passing;
        passing = -1;
      }
    }
    return best;
  }
}
