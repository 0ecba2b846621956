/** One inspection as last received from the server, and the actions on it. */

import { get, patch, post, put } from './api.js';
import { Store } from './store.js';

/** Whether the server is still processing it. */
export const isUnfinished = ({ status }) => status === 'queued' || status === 'running';

/** Whether there are pictures: an imported survey has no film. */
export const hasFilm = ({ source }) => source.kind !== 'import';

/** Whether it was recorded from a camera and can be continued. */
export const mayGoOn = (inspection) =>
  inspection.source.kind === 'live' && !isUnfinished(inspection) && inspection.video.codec !== '';

/** Whether another program measured the distances, so that their intervals are unknown. */
export const isUnmeasured = ({ source, video }) => source.kind === 'import' && video.codec === '';

export class Inspection extends Store {
  #path;
  #signal;

  /**
   * @param {string} id
   * @param {AbortSignal} signal
   */
  constructor(id, signal) {
    super(null);
    this.id = id;
    this.#path = `/api/inspections/${id}`;
    this.#signal = signal;
  }

  get isUnfinished() {
    return this.value !== null && isUnfinished(this.value);
  }

  async load() {
    this.set(await get(this.#path, this.#signal));
  }

  /** Changes name or header; fires `edited` with the step of the history. */
  async change(changes) {
    const before = this.value;
    await this.#put(changes);
    const detail = this.#step(differences(before, this.value));
    if (detail.changes.length) this.dispatchEvent(new CustomEvent('edited', { detail }));
  }

  async #put(changes) {
    this.set(await patch(this.#path, changes, this.#signal));
  }

  /**
   * Undoes or redoes field by field: changes of other fields by others stay.
   * @returns {import('./history.js').Step}
   */
  #step(changes) {
    return {
      what: 'header',
      changes,
      run: async (isBack) => {
        const { name, header } = this.value;
        const wanted = { name, ...header };
        for (const change of changes) wanted[change.name] = (isBack ? change.before : change.after) ?? null;
        const { name: newName, ...fields } = wanted;
        const stated = Object.entries(fields).filter(([, value]) => value !== null);
        await this.#put({ name: newName, header: Object.fromEntries(stated) });
      },
      isOvertaken: async (isBack) => {
        await this.load();
        const now = fieldsOf(this.value);
        return changes.some((change) => !isSame(now[change.name], isBack ? change.after : change.before));
      },
    };
  }

  /** Ends the survey; a live one stops. */
  async finish(how) {
    this.set(await post(`${this.#path}/finish`, how));
  }

  /** Withdraws the end of the survey. */
  async reopen() {
    const { end_condition, abandon_reason, ...header } = this.value.header;
    await this.#put({ header });
  }

  async cancel() {
    await post(`${this.#path}/cancel`);
    await this.load();
  }

  /** Continues the recording of a camera; `robot`: stood_still or moved. */
  async recordOn(url, robot) {
    this.set(await post(`${this.#path}/continue`, { url, robot }));
  }

  /** Tracks all frames again with this rig. */
  async trackWith(rig) {
    this.set(await put(`${this.#path}/rig`, { rig }));
  }

  async retry() {
    await post(`${this.#path}/retry`);
    await this.load();
  }
}

/** Returns name and header side by side; no header field is called name. */
const fieldsOf = ({ name, header }) => ({ name, ...header });

const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/** Returns the fields in which two states of an inspection differ: [{name, before, after}]. */
function differences(one, other) {
  const [before, after] = [fieldsOf(one), fieldsOf(other)];
  return [...new Set([...Object.keys(before), ...Object.keys(after)])]
    .map((name) => ({ name, before: before[name], after: after[name] }))
    .filter((change) => !isSame(change.before, change.after));
}
