/** One inspection as last received from the server, and the actions on it. */

import { get, patch, post, put } from '../server/api.js';
import { Store } from '../page/store.js';

/** Whether the server is still processing it. @param {{status: string}} inspection */
export const isUnfinished = ({ status }) => status === 'queued' || status === 'running';

/** Whether there are pictures: an imported survey has no film. @param {{source: {kind: string}}} inspection */
export const hasFilm = ({ source }) => source.kind !== 'import';

/** Whether it was recorded from a camera and can be continued. @param {Api['InspectionOut']} inspection */
export const mayGoOn = (inspection) =>
  inspection.source.kind === 'live' && !isUnfinished(inspection) && inspection.video.codec !== '';

/** Whether the header says that the survey has ended. @param {{header: Record<string, any>}} inspection */
export const isFinished = ({ header }) => Boolean(header.end_condition);

/**
 * Whether another program measured the distances, so that their intervals are unknown.
 * @param {Pick<Api['InspectionOut'], 'source'|'video'>} inspection
 */
export const isUnmeasured = ({ source, video }) => source.kind === 'import' && video.codec === '';

/**
 * @typedef {{name: string, header: Record<string, unknown>}} Named
 * @typedef {{name: string, before: unknown, after: unknown}} Difference of a field
 */

/** @extends {Store<Api['InspectionOut']|null>} */
export class Inspection extends Store {
  /** Why its track cannot be read, so that it is to be tracked again. @type {string|null} */
  damage = null;
  #path;
  #signal;
  #version = 0;

  /** @param {string} id @param {AbortSignal} signal */
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
    const version = this.#version;
    const answer = await get(this.#path, this.#signal);
    if (version === this.#version) this.set(answer);
    else await this.load(); // changed meanwhile: the answer is older than what is shown
  }

  /** @param {Api['InspectionOut']} answer */
  #take(answer) {
    this.#version += 1;
    this.set(answer);
  }

  /**
   * States fields of the header as one change, and leaves the other fields as they are stored; fires `edited`
   * with the step of the history.
   * @param {Map<string, {value: string|number|boolean|null, own: unknown[]}>} entries by field; own: values that
   *     the person has seen or stated in it
   * @returns {Promise<Map<string, unknown>>} the values that somebody else has stated, of the fields that stay
   *     as they are for that reason
   */
  async stateFields(entries) {
    const theirs = new Map();
    const before = await this.#put(({ header }) => {
      theirs.clear();
      const wanted = { ...header };
      for (const [name, { value, own }] of entries) {
        const now = header[name] ?? null;
        if ([...own, value].some((known) => isSame(known, now))) wanted[name] = value;
        else theirs.set(name, now);
      }
      return theirs.size === entries.size ? null : { header: stated(wanted) };
    });
    if (theirs.size < entries.size) this.#edited(before);
    return theirs;
  }

  /**
   * Gives name and header the content of an earlier version; fires `edited` with the step of the history.
   * @returns {Promise<boolean>} whether that is a change
   * @param {Named} content
   */
  async restore({ name, header }) {
    return this.#edited(await this.#put(() => ({ name, header })));
  }

  /**
   * Reports what has changed since `before`, as a step of the history; false if nothing has.
   * @param {Api['InspectionOut']} before
   */
  #edited(before) {
    const detail = this.#step(differences(before, this.value));
    if (detail.changes.length) this.dispatchEvent(new CustomEvent('edited', { detail }));
    return detail.changes.length > 0;
  }

  /**
   * Changes name or header, based on the stored state; tries again with the new state when somebody else was
   * faster.
   * @param {(inspection: Api['InspectionOut']) => object|null} changesOf null leaves it as it is
   * @returns {Promise<Api['InspectionOut']>} the stored state that the change was based on
   */
  async #put(changesOf) {
    for (;;) {
      const before = this.value;
      const changes = changesOf(before);
      if (changes === null) return before;
      try {
        this.#take(await patch(this.#path, changes, this.#signal, before.version));
        return before;
      } catch (error) {
        if (!error.isOvertaken) throw error;
      }
      await this.load();
    }
  }

  /**
   * Undoes or redoes field by field: changes of other fields by others stay.
   * @returns {import('../defects/history.js').Step}
   * @param {Difference[]} changes
   */
  #step(changes) {
    return {
      what: 'header',
      changes,
      run: (isBack) =>
        this.#put((inspection) => {
          const wanted = fieldsOf(inspection);
          for (const change of changes) wanted[change.name] = (isBack ? change.before : change.after) ?? null;
          const { name, ...fields } = wanted;
          return { name, header: stated(fields) };
        }),
      isOvertaken: async (isBack) => {
        await this.load();
        const now = fieldsOf(this.value);
        return changes.some((change) => !isSame(now[change.name], isBack ? change.after : change.before));
      },
    };
  }

  /** Ends the survey; a live one stops. @param {Api['FinishIn']} how */
  async finish(how) {
    this.#take(await post(`${this.#path}/finish`, how));
  }

  /** Withdraws the end of the survey. */
  async reopen() {
    await this.#put(({ header: { end_condition, abandon_reason, ...header } }) => ({ header }));
  }

  async cancel() {
    await post(`${this.#path}/cancel`);
    await this.load();
  }

  /**
   * Continues the recording of a camera; `robot`: stood_still or moved.
   * @param {string} url
   * @param {'stood_still'|'moved'} robot
   */
  async recordOn(url, robot) {
    this.#take(await post(`${this.#path}/continue`, { url, robot }));
  }

  /** Tracks all frames again with this rig. @param {object} rig */
  async trackWith(rig) {
    this.#take(await put(`${this.#path}/rig`, { rig }));
  }

  /** @param {string} reason */
  noteDamage(reason) {
    if (this.damage === reason) return;
    this.damage = reason;
    this.dispatchEvent(new Event('change'));
  }

  async retry() {
    await post(`${this.#path}/retry`);
    await this.load();
  }
}

/**
 * Returns name and header side by side; no header field is called name.
 * @param {Named} inspection
 * @returns {Record<string, unknown>}
 */
const fieldsOf = ({ name, header }) => ({ name, ...header });

/** Returns the filled fields of a header. @param {Record<string, unknown>} fields */
const stated = (fields) => Object.fromEntries(Object.entries(fields).filter(([, value]) => value !== null));

/** @param {unknown} a @param {unknown} b */
const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/**
 * Returns the fields in which two states of an inspection differ: [{name, before, after}].
 * @param {Named} one
 * @param {Named} other
 * @returns {Difference[]}
 */
function differences(one, other) {
  const [before, after] = [fieldsOf(one), fieldsOf(other)];
  return [...new Set([...Object.keys(before), ...Object.keys(after)])]
    .map((name) => ({ name, before: before[name], after: after[name] }))
    .filter((change) => !isSame(change.before, change.after));
}
