/** Complaints about the picture of every tracked frame; grows with the track. */

import { ApiError } from './api.js';
import { GrowingColumns, getColumns } from './columns.js';

/** All complaints, in the order of their bits. */
export const COMPLAINTS = ['too_fast', 'too_dark', 'too_bright', 'blurred', 'lens_dirty'];

const TYPES = { complaints: Uint8Array, overlap: Float32Array, fixed_pattern: Float32Array };

/** Fires `change` when frames were added or the run was restarted. */
export class Health extends EventTarget {
  #path;
  #columns = new GrowingColumns(TYPES);
  /** All bits that have occurred. */
  occurred = 0;
  /** Rises when the run is restarted. */
  generation = 0;

  /** @param {string} inspection */
  constructor(inspection) {
    super();
    this.#path = `/api/inspections/${inspection}/health`;
  }

  /** For each frame, one bit for each complaint. */
  get complaints() {
    return this.#columns.column('complaints');
  }

  /** Fetches the frames that are new since the last call. */
  async extend(signal) {
    const { generation } = this;
    const columns = await this.#ask(signal);
    if (generation !== this.generation || !columns?.complaints.length) return;
    this.#columns.extend(columns, columns.complaints.length);
    for (const bits of columns.complaints) this.occurred |= bits;
    this.dispatchEvent(new Event('change'));
  }

  /** Returns the health of one frame, in the form of the live socket; null where it is unknown. */
  at(frame) {
    if (!(frame in this.complaints)) return null;
    return {
      overlap: this.#columns.column('overlap')[frame],
      fixed_pattern: this.#columns.column('fixed_pattern')[frame],
      complaints: namesOf(this.complaints[frame]),
    };
  }

  clear() {
    this.#columns = new GrowingColumns(TYPES);
    this.occurred = 0;
    this.generation += 1;
    this.dispatchEvent(new Event('change'));
  }

  /** Fetches health; an inspection tracked before the server stored it has none, which is no fault. */
  async #ask(signal) {
    try {
      return await getColumns(`${this.#path}?format=columns&since=${this.#columns.length}`, signal);
    } catch (error) {
      if (error instanceof ApiError && error.status === 404) return null;
      throw error;
    }
  }
}

/** Returns the names of the complaints in a set of bits. */
export const namesOf = (bits) => COMPLAINTS.filter((_, n) => bits & (1 << n));
