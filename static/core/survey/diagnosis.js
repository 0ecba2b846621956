/** Why the distances of an inspection are of no use, and what to change before it is tracked again. */

import { get } from '../server/api.js';
import { Store } from '../page/store.js';
import { wordFor } from '../page/words.js';
import { hasFilm, isUnfinished } from './inspection.js';

/** What can be changed; other repairs are no change. @type {string[]} */
export const CHANGES = ['axis', 'pipe', 'lens'];

/** @typedef {Api['CauseOut']} Cause */

/** The repair of a disagreement of picture and rig, by its code. @type {Record<string, Cause['repair']>} */
const OF_NOTICES = {
  joints_doubted: 'pipe',
  rings_uncounted: 'pipe',
  waves_unstated: 'pipe',
  pitch_doubted: 'pipe',
  rig_doubted: 'lens',
  height_doubted: 'pipe',
  looks_up: 'axis',
  looks_down: 'axis',
};

/** @extends {Store<Api['DiagnosisOut']|null>} */
export class Diagnosis extends Store {
  #inspection;
  /** The state that the present value is of. */
  #of = '';

  /** @param {import('./inspection.js').Inspection} inspection */
  constructor(inspection) {
    super(null);
    this.#inspection = inspection;
  }

  /** Asks again once the run has ended or the distances have changed. @param {AbortSignal} signal */
  async load(signal) {
    const inspection = this.#inspection.value;
    const { id, finished_at: at, revision, status } = inspection;
    const state = [at, revision, status].join(' ');
    if (state === this.#of || !hasFilm(inspection)) return;
    this.#of = state;
    this.set(isUnfinished(inspection) ? null : await get(`/api/inspections/${id}/diagnosis`, signal));
  }
}

/**
 * Returns what a cause is, in words of the job.
 * @param {Cause} cause
 */
export const causeText = ({ code, params }) => wordFor('cause', code, params);

/** @param {{code: string}} notice */
export const repairOf = ({ code }) => OF_NOTICES[code] ?? null;
