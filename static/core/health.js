/** Complaints about the picture of every tracked frame; grows with the track. */

import { ApiError, get } from './api.js';

/** All complaints, in the order of their bits. */
export const COMPLAINTS = ['too_fast', 'too_dark', 'too_bright', 'blurred', 'lens_dirty'];

const BITS = new Map(COMPLAINTS.map((name, i) => [name, 1 << i]));

/** Fires `change` when frames were added or the run was restarted. */
export class Health extends EventTarget {
  #path;
  /** For each frame, one bit for each complaint. */
  complaints = [];
  /** The figures shown with a complaint. */
  #overlap = [];
  #fixedPattern = [];
  /** All bits that have occurred. */
  occurred = 0;
  /** Rises when the run is restarted. */
  generation = 0;

  /** @param {string} inspection */
  constructor(inspection) {
    super();
    this.#path = `/api/inspections/${inspection}/health`;
  }

  /** Fetches the frames that are new since the last call. */
  async extend(signal) {
    const { generation } = this;
    const columns = await this.#ask(signal);
    if (generation !== this.generation || !columns?.complaints.length) return;
    columns.complaints.forEach((names, i) => {
      const bits = bitsOf(names);
      this.complaints.push(bits);
      this.#overlap.push(columns.overlap[i]);
      this.#fixedPattern.push(columns.fixed_pattern[i]);
      this.occurred |= bits;
    });
    this.dispatchEvent(new Event('change'));
  }

  /** Returns the health of one frame, in the form of the live socket; null where it is unknown. */
  at(frame) {
    if (!(frame in this.complaints)) return null;
    return {
      overlap: this.#overlap[frame],
      fixed_pattern: this.#fixedPattern[frame],
      complaints: namesOf(this.complaints[frame]),
    };
  }

  clear() {
    this.complaints = [];
    this.#overlap = [];
    this.#fixedPattern = [];
    this.occurred = 0;
    this.generation += 1;
    this.dispatchEvent(new Event('change'));
  }

  /** Fetches health; an inspection tracked before the server stored it has none, which is no fault. */
  async #ask(signal) {
    try {
      return (await get(`${this.#path}?since=${this.complaints.length}`, signal)).columns;
    } catch (error) {
      if (error instanceof ApiError && error.status === 404) return null;
      throw error;
    }
  }
}

const bitsOf = (names) =>
  names === '' ? 0 : names.split(' ').reduce((bits, name) => bits | (BITS.get(name) ?? 0), 0);

/** Returns the names of the complaints in a set of bits. */
export const namesOf = (bits) => COMPLAINTS.filter((name) => bits & BITS.get(name));
