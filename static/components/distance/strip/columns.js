/**
 * Reduces very many frames for a strip: for every pixel column the extremes of its frames, so that a short
 * loss stays visible at any zoom, and 100 000 frames are drawn as fast as 1000.
 */

/** Speed is averaged over this time before the frame. */
const SPEED_WINDOW_S = 0.5;

/** Speed in m/min of every frame of a growing track. */
export class Speeds {
  values = [];
  #first = 0;

  /** @param {import('../../../core/survey/track.js').Track} track the same track, or a longer one */
  extend(track) {
    const [times, distances] = [track.column('time_s'), track.column('distance_mm')];
    for (let i = this.values.length; i < times.length; i += 1) {
      while (times[i] - times[this.#first] > SPEED_WINDOW_S && this.#first < i - 1) this.#first += 1;
      const seconds = times[i] - times[this.#first];
      const mm = Math.abs(distances[i] - distances[this.#first]);
      this.values.push(seconds > 0 ? (mm / seconds) * 0.06 : 0);
    }
  }
}

/** @typedef {{count: number, low: number, mmPerColumn: number}} Raster columns, and where the first lies in mm */

/** The least and the greatest value of the frames in each column; Infinity and -Infinity without any. */
export class Band {
  /** Number of frames included. */
  #length = 0;
  #raster;
  #before = null;

  /** @param {Raster} raster */
  constructor(raster) {
    this.#raster = raster;
    this.least = new Float32Array(raster.count).fill(Infinity);
    this.greatest = new Float32Array(raster.count).fill(-Infinity);
  }

  /**
   * Adds the frames that are new.
   * @param {ArrayLike<number>} distances mm of every frame
   * @param {(frame: number) => number} valueAt NaN where there is none
   */
  add(distances, valueAt) {
    const { low, mmPerColumn, count } = this.#raster;
    const { least, greatest } = this;
    let before = this.#before;
    for (let i = this.#length; i < distances.length; i += 1) {
      const value = valueAt(i);
      if (Number.isNaN(value)) continue;
      const at = Math.round((distances[i] - low) / mmPerColumn);
      // Between two frames the robot passed every column between them.
      const first = Math.max(Math.min(before ?? at, at), 0);
      const last = Math.min(Math.max(before ?? at, at), count - 1);
      before = at;
      for (let x = first; x <= last; x += 1) {
        if (value < least[x]) least[x] = value;
        if (value > greatest[x]) greatest[x] = value;
      }
    }
    this.#before = before;
    this.#length = distances.length;
  }

  /** Whether a column has no frames. */
  isEmpty(column) {
    return this.least[column] > this.greatest[column];
  }

  /** The greatest magnitude of all columns. */
  get most() {
    const larger = (most, value) => (Number.isFinite(value) ? Math.max(most, Math.abs(value)) : most);
    return this.greatest.reduce(larger, this.least.reduce(larger, 0));
  }
}
