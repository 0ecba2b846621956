/** The distance counter that is burnt into a film: what is known of it, and its readings beside the track. */

import { get, poll, post, put } from '../server/api.js';
import { RunColumns } from '../page/columns.js';
import { Store } from '../page/store.js';

const ASK_EVERY_S = 1;

/**
 * @typedef {Api['CounterFaultOut']} Fault a stretch in which the counter did not count what the camera drove
 * @typedef {{box?: Box|null, unit?: 'm'|'ft'|null, percent?: number|null}} Stated percent: the uncertainty of its way
 * @typedef {[number, number, number, number]} Box left, top, right and bottom in pixels of the film
 */

/** A store of the server's answer; null until it is loaded. @extends {Store<Api['CounterOut']|null>} */
export class FilmCounter extends Store {
  /** Column `counter_m`: the reading of every frame, NaN where it is not legible. */
  readings;

  #path;
  #signal;
  #isFollowing = false;
  /** Version and unit of `readings`. */
  #shown = '';

  /** @param {string} inspection @param {AbortSignal} signal */
  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/counter`;
    this.#signal = signal;
    this.readings = new RunColumns(`${this.#path}/readings?format=columns`, { counter_m: Float64Array });
  }

  /** What a person has stated; a unit that the film shows needs no statement. @returns {Stated} */
  get stated() {
    const { unit, is_unit_shown: isShown, is_box_drawn: isDrawn, box, percent } = /** @type {any} */ (this.value);
    return { unit: isShown ? null : unit, box: isDrawn ? box : null, percent };
  }

  /** @returns {Fault[]} */
  get faults() {
    return this.value?.comparison?.faults ?? [];
  }

  async load() {
    await this.#take(await get(this.#path, this.#signal));
  }

  /**
   * Asks again and again while the film is read; for a film whose tracking has ended.
   * @param {(error: import('../server/api.js').ApiError) => void} onError
   */
  async follow(onError) {
    if (this.#isFollowing) return;
    this.#isFollowing = true;
    const ask = async () => {
      await this.load();
      return this.value.state === 'waiting' ? ASK_EVERY_S : null;
    };
    await poll(ask, this.#signal, onError);
    this.#isFollowing = false;
  }

  /**
   * States where the counter is, or its unit, or that there is none; the film is read again if need be.
   * @param {Stated & {is_present?: boolean}} stated
   */
  async state(stated) {
    await this.#take(await put(this.#path, stated, this.#signal));
  }

  async cancel() {
    await this.#take(await post(`${this.#path}/cancel`, undefined, this.#signal));
  }

  /** @param {Api['CounterOut']} answer */
  async #take(answer) {
    const shown = answer.version && `${answer.version} ${answer.unit}`;
    if (shown !== this.#shown) {
      if (shown) await this.readings.reload(this.#signal);
      else this.readings.clear();
      this.#shown = shown;
    }
    this.set(answer);
  }
}

/**
 * Returns by how many mm the counter is ahead of the camera in each frame, NaN where it is not legible. It
 * begins with 0 and goes on with the same value where the counter was set to another one.
 * @param {import('../page/columns.js').Column} distances of the camera, mm
 * @param {import('../page/columns.js').Column} readings m
 * @param {Fault[]} faults
 */
export function deviations(distances, readings, faults) {
  /** @param {number} frame */
  const ahead = (frame) => 1000 * readings[frame] - distances[frame];
  const resets = faults.filter(({ kind }) => kind === 'reset');
  const found = new Float64Array(Math.min(distances.length, readings.length)).fill(NaN);
  /** @type {number|null} */
  let zero = null;
  let passed = 0;
  for (let i = 0; i < found.length; i += 1) {
    if (Number.isNaN(readings[i])) continue;
    zero ??= ahead(i);
    for (; passed < resets.length && i >= resets[passed].last_frame; passed += 1) {
      const { first_frame: before, last_frame: after } = resets[passed];
      zero += ahead(after) - ahead(before);
    }
    found[i] = ahead(i) - zero;
  }
  return found;
}
