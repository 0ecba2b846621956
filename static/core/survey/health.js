/** Complaints about the picture of every tracked frame; grows with the track. */

import { RunColumns } from '../page/columns.js';

/**
 * What clients usually allow a crew, 30 ft/min in their specifications, so that a viewer overlooks no defect. What the
 * tracking bears depends on the rig, and is mostly more.
 */
export const USUAL_LIMIT_M_PER_MIN = 9;

/** All complaints, in the order of their bits. */
export const COMPLAINTS = ['too_fast', 'too_dark', 'too_bright', 'blurred', 'lens_dirty'];

const TYPES = { complaints: Uint8Array, overlap: Float32Array, fixed_pattern: Float32Array };

export class Health extends RunColumns {
  /** Bits that have occurred in the first `#looked` frames. */
  #occurred = 0;
  #looked = 0;

  /** @param {string} inspection */
  constructor(inspection) {
    super(`/api/inspections/${inspection}/health?format=columns`, TYPES);
  }

  /** For each frame, one bit for each complaint. */
  get complaints() {
    return this.column('complaints');
  }

  /** All bits that have occurred. */
  get occurred() {
    const { complaints } = this;
    for (; this.#looked < complaints.length; this.#looked += 1) this.#occurred |= complaints[this.#looked];
    return this.#occurred;
  }

  /**
   * Returns the health of one frame, in the form of the live socket; null where it is unknown.
   * @param {number} frame
   */
  at(frame) {
    if (!(frame in this.complaints)) return null;
    return {
      overlap: this.column('overlap')[frame],
      fixed_pattern: this.column('fixed_pattern')[frame],
      complaints: namesOf(this.complaints[frame]),
    };
  }

  began() {
    [this.#occurred, this.#looked] = [0, 0];
  }
}

/** Returns the names of the complaints in a set of bits. @param {number} bits */
export const namesOf = (bits) => COMPLAINTS.filter((_, n) => bits & (1 << n));
