/**
 * The track of one inspection: for every frame its presentation time and where the robot was.
 * The times are the PTS table of the video: a picture is found by its time, never by time * fps.
 */

import { get } from './api.js';

const COLUMNS = [
  'time_s', 'x_mm', 'y_mm', 'yaw_deg', 'distance_mm', 'sigma_distance_mm', 'quality', 'status',
];
/** Browsers round media times to microseconds. */
const ROUNDING_S = 0.0005;

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
 */

/** Fires `change` when rows were added or the track was begun anew. */
export class Track extends EventTarget {
  #path;
  #columns = emptyColumns();
  /** Rises when the track begins anew: what was worked out from an earlier one is void. */
  generation = 0;

  constructor(inspectionId) {
    super();
    this.#path = `/api/inspections/${inspectionId}/track?format=json`;
  }

  get length() {
    return this.#columns.time_s.length;
  }

  /** One column, for drawing. */
  column(name) {
    return this.#columns[name];
  }

  /** @returns {Row|null} */
  row(frame) {
    if (!(frame >= 0 && frame < this.length)) return null;
    const row = { frame };
    for (const name of COLUMNS) row[name] = this.#columns[name][frame];
    return row;
  }

  /** Fetches the rows that are new since the last call. */
  async extend(signal) {
    const { columns } = await get(`${this.#path}&since=${this.length}`, signal);
    if (columns.time_s.length === 0) return;
    for (const name of COLUMNS) {
      for (const value of columns[name]) this.#columns[name].push(value);
    }
    this.dispatchEvent(new Event('change'));
  }

  clear() {
    this.#columns = emptyColumns();
    this.generation += 1;
    this.dispatchEvent(new Event('change'));
  }

  /** The frame that is on screen at this media time; -1 without a track. */
  frameAt(timeS) {
    const times = this.#columns.time_s;
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= timeS + ROUNDING_S) low = middle + 1;
      else high = middle;
    }
    return Math.max(low - 1, Math.min(0, times.length - 1));
  }

  /** Where to seek for this frame: the middle of its interval, as its very start may show the one before. */
  seekTime(frame) {
    const times = this.#columns.time_s;
    if (frame + 1 < times.length) return (times[frame] + times[frame + 1]) / 2;
    const interval = frame > 0 ? times[frame] - times[frame - 1] : 0;
    return times[frame] + interval / 2;
  }

  /**
   * The frame nearest to a distance; of several (the robot reversed) the one nearest to `frame`.
   * @param {number} distanceMm
   * @param {number} frame
   */
  frameAtDistance(distanceMm, frame) {
    const distances = this.#columns.distance_mm;
    let nearest = Infinity;
    for (const distance of distances) nearest = Math.min(nearest, Math.abs(distance - distanceMm));
    const tolerance = nearest + 5;
    let best = -1;
    for (let i = 0; i < distances.length; i += 1) {
      const isNear = Math.abs(distances[i] - distanceMm) <= tolerance;
      if (isNear && (best < 0 || Math.abs(i - frame) < Math.abs(best - frame))) best = i;
    }
    return best;
  }
}

function emptyColumns() {
  return Object.fromEntries(COLUMNS.map((name) => [name, []]));
}
