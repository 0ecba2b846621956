/**
 * Reduces very many frames for a strip: for every pixel column the extremes of its frames, so that a short
 * loss stays visible at any zoom, and 100 000 frames are drawn as fast as 1000.
 */

/** Rank of a column without frames. */
export const EMPTY = 255;

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

/** Extremes per column; `add` takes only the frames that are new. */
export class Columns {
  /** Number of frames included. */
  length = 0;

  #low;
  #perMm;
  #before = null;

  /**
   * @param {number} count of columns
   * @param {number} low distance in mm of the first
   * @param {number} mmPerColumn
   */
  constructor(count, low, mmPerColumn) {
    this.count = count;
    this.#low = low;
    this.#perMm = 1 / mmPerColumn;
    this.rank = new Uint8Array(count).fill(EMPTY);
    this.quality = new Float32Array(count).fill(1);
    this.speed = new Float32Array(count);
    this.leftmost = new Float32Array(count).fill(Infinity);
    this.rightmost = new Float32Array(count).fill(-Infinity);
    this.leastYaw = new Float32Array(count).fill(Infinity);
    this.mostYaw = new Float32Array(count).fill(-Infinity);
    this.complaints = new Uint8Array(count);
  }

  /**
   * Adds the frames from `length` to `to`.
   * @param {import('../../../core/survey/track.js').Track} track
   * @param {number[]} speeds
   * @param {number[]} complaints
   * @param {number} to
   */
  add(track, speeds, complaints, to) {
    const [distances, qualities, states, lateral, yaw] = ['distance_mm', 'quality', 'status', 'y_mm', 'yaw_deg'].map(
      (name) => track.column(name),
    );
    let before = this.#before;
    for (let i = this.length; i < to; i += 1) {
      const at = Math.round((distances[i] - this.#low) * this.#perMm);
      // Between two frames the robot passed every column between them.
      const first = Math.max(before === null || at < before ? at : before, 0);
      const last = Math.min(before === null || at > before ? at : before, this.count - 1);
      before = at;
      if (first > last) continue;
      const rank = states[i];
      for (let x = first; x <= last; x += 1) {
        const known = this.rank[x];
        if (known === EMPTY || rank > known) this.rank[x] = rank;
        if (qualities[i] < this.quality[x]) this.quality[x] = qualities[i];
        if (speeds[i] > this.speed[x]) this.speed[x] = speeds[i];
        if (lateral[i] < this.leftmost[x]) this.leftmost[x] = lateral[i];
        if (lateral[i] > this.rightmost[x]) this.rightmost[x] = lateral[i];
        if (yaw[i] < this.leastYaw[x]) this.leastYaw[x] = yaw[i];
        if (yaw[i] > this.mostYaw[x]) this.mostYaw[x] = yaw[i];
        this.complaints[x] |= complaints[i] ?? 0;
      }
    }
    this.#before = before;
    this.length = to;
  }
}

/** The least and the greatest value of the frames in each column; Infinity and -Infinity without any. */
export class Band {
  /**
   * @param {import('../../../core/page/columns.js').Column} distances mm of every frame
   * @param {Float64Array} values NaN where there is none
   * @param {number} count of columns
   * @param {number} low distance in mm of the first
   * @param {number} mmPerColumn
   */
  constructor(distances, values, count, low, mmPerColumn) {
    this.least = new Float32Array(count).fill(Infinity);
    this.greatest = new Float32Array(count).fill(-Infinity);
    let before = null;
    for (let i = 0; i < values.length; i += 1) {
      if (Number.isNaN(values[i])) continue;
      const at = Math.round((distances[i] - low) / mmPerColumn);
      const first = Math.max(Math.min(before ?? at, at), 0);
      const last = Math.min(Math.max(before ?? at, at), count - 1);
      before = at;
      for (let x = first; x <= last; x += 1) {
        if (values[i] < this.least[x]) this.least[x] = values[i];
        if (values[i] > this.greatest[x]) this.greatest[x] = values[i];
      }
    }
  }
}
