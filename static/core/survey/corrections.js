/**
 * Statements about the distances of one inspection and their result: the stored ones, and a draft with its
 * preview, so that the residuals are visible before anything is changed.
 */

import { get, post, put, refusalIn } from '../server/api.js';
import { ofPerson, recall, remember } from '../page/remembered.js';
import { Store } from '../page/store.js';

/**
 * @typedef {Required<Api['Length']>} Length
 * @typedef {Required<Api['Stated']>} Stated
 * @typedef {Record<string, any> & import('../wall/joints.js').Joints} Result
 * @typedef {{stated: Stated, result: Result|null, error: Api['ErrorOut']|null,
 *     reason?: import('./evidence.js').Reason|null, version?: string}} Answer
 */

/** @type {Stated} */
export const UNSTATED = {
  zero: null,
  lengths: [],
  joints: { use: null, marked: [], left_out: [] },
  rig_sigma: null,
  typed: [],
  forced: null,
};

/** One sigma in mm of a length by its source, as a header names it. */
export const SIGMA_MM = { drawing: 50, survey: 10, tape: 5 };

/** Statements with another known length, null for none. @param {Stated} stated @param {Omit<Length, 'kind'>|null} length */
export function withKnownLength(stated, length) {
  const others = stated.lengths.filter(({ kind }) => kind !== 'known');
  return { ...stated, lengths: length ? [...others, /** @type {Length} */ ({ ...length, kind: 'known' })] : others };
}

/** The known length of a statement, or undefined. @param {{lengths: Length[]}} stated */
export const knownLength = ({ lengths }) => lengths.find(({ kind }) => kind === 'known');

/**
 * Returns stored statements with those that a person made before the page had read them: these are added, and they
 * count where both state one thing.
 * @param {Stated} stored
 * @param {Stated} early
 */
function withEarly(stored, early) {
  /** @param {any} theirs @param {any} ours @returns {any} */
  const both = (theirs, ours) => {
    if (Array.isArray(ours)) return [...theirs, ...ours];
    if (ours === null || typeof ours !== 'object' || theirs === null) return ours ?? theirs;
    return Object.fromEntries(Object.keys(ours).map((name) => [name, both(theirs[name], ours[name])]));
  };
  return withKnownLength(both(stored, early), knownLength(early) ?? knownLength(stored) ?? null);
}

/** A store of the answer for the stored statements; null until it is loaded. @extends {Store<Answer|null>} */
export class Corrections extends Store {
  /** The statements being edited. */
  draft = new Store(UNSTATED);
  /** The result of the draft; null while it is computed. */
  preview = new Store(/** @type {Answer|null} */ (null));

  #path;
  #signal;
  /** @type {AbortController|null} */
  #asking = null;
  #version = 0;
  /** Version of the statements on which the draft is based. @type {string|null} */
  #draftOf = null;
  /** @type {Waiting|null} */
  #waiting = null;
  /** Where this browser keeps the person's draft that waits. */
  #key;

  /** @param {string} inspection @param {AbortSignal} signal */
  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/corrections`;
    this.#signal = signal;
    this.#key = ofPerson(`chainage.unsent-corrections.${inspection}`);
  }

  /** Goes on with the draft that waits for a decision since an earlier page. */
  restore() {
    this.#waiting = recall(this.#key, null);
    if (!this.#waiting) return;
    this.#draftOf = this.#waiting.version;
    this.draft.set(this.#waiting.stated);
  }

  /** Whether the draft differs from the stored statements. */
  get isEdited() {
    return this.value !== null && !isSame(this.draft.value, this.value.stated);
  }

  /** Whether the stored statements are no longer those on which the draft is based. */
  get isOvertaken() {
    return this.isEdited && this.#draftOf !== this.value.version;
  }

  /** The draft that waits for a decision because it was overtaken, or null. */
  get waiting() {
    return this.#waiting;
  }

  /** The version on which the draft is based. */
  get draftOf() {
    return this.#draftOf;
  }

  /** Loads the stored statements; a draft that was begun is kept and compared with them. */
  async load() {
    const version = this.#version;
    const answer = await get(this.#path, this.#signal);
    if (version !== this.#version) {
      await this.load(); // statements changed meanwhile: the answer is older than what is shown
      return;
    }
    const isFirst = this.value === null;
    const { value: early } = this.draft;
    const hadDraft = isFirst ? this.#waiting !== null : this.isEdited;
    this.set(answer);
    if (!hadDraft || !this.isEdited) this.#begin();
    if (isFirst && !hadDraft && early !== UNSTATED) this.draft.set(withEarly(answer.stated, early));
    this.#ask();
  }

  /** Begins a draft with the stored statements; the one before it is settled. */
  #begin() {
    if (this.#waiting) this.#keep(null);
    this.#draftOf = this.value.version;
    this.draft.set(this.value.stated);
  }

  /** @param {Partial<Stated>} changes */
  edit(changes) {
    this.draft.set({ ...this.draft.value, ...changes });
    if (this.#waiting) this.wait(this.#waiting.remark);
    this.#ask();
  }

  /**
   * Keeps the draft in this browser, with the reason for it, until it is applied or discarded.
   * @param {string|null} remark
   */
  wait(remark) {
    this.#keep({ stated: this.draft.value, remark, version: this.#draftOf });
  }

  /** @param {Waiting|null} waiting */
  #keep(waiting) {
    this.#waiting = waiting;
    remember(this.#key, waiting);
  }

  discard() {
    this.#begin();
    this.#ask();
  }

  /**
   * Returns the result of some statements without storing them.
   * @param {Stated} stated
   * @param {AbortSignal} [signal]
   * @returns {Promise<Answer>}
   */
  ask(stated, signal = this.#signal) {
    return post(`${this.#path}/preview`, stated, signal);
  }

  /**
   * Replaces the stored statements; applying the earlier ones undoes this. A draft of something else stays.
   * @param {Stated} stated
   * @param {string|null} remark why, for the history
   * @param {string} replaced version of the statements to replace; if another version is stored by now, nothing changes
   */
  async apply(stated, remark, replaced) {
    const draft = this.draft.value;
    const isApplied = isSame(stated, draft);
    const isOther = this.isEdited && !isApplied;
    const answer = await put(this.#path, { ...stated, remark }, undefined, replaced);
    this.#version += 1;
    if (isApplied) this.#draftOf = answer.version; // what was added to it meanwhile is based on it
    this.set(answer);
    const isSameDraft = this.draft.value === draft;
    if (isSameDraft && !isOther) this.#begin();
    this.#ask();
  }

  /** Previews the draft; a newer draft cancels a pending request. */
  async #ask() {
    this.#asking?.abort();
    if (!this.isEdited) {
      this.preview.set(this.value);
      return;
    }
    this.#asking = new AbortController();
    const { signal } = this.#asking;
    this.preview.set(null);
    const stated = this.draft.value;
    try {
      const answer = await this.ask(stated, AbortSignal.any([signal, this.#signal]));
      if (!signal.aborted) this.preview.set(answer);
    } catch (error) {
      const refusal = refusalIn(error);
      if (refusal) this.preview.set({ stated, result: null, error: { code: refusal.code, detail: refusal.message } });
    }
  }
}

/**
 * @typedef {object} Waiting
 * @property {Stated} stated
 * @property {string|null} remark
 * @property {string} version of the statements on which it is based
 */

/** Whether two JSON values are equal, in any order of keys. @param {unknown} a @param {unknown} b @returns {boolean} */
export function isSame(a, b) {
  if (a === b) return true;
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return false;
  const [one, other] = [new Map(Object.entries(a)), new Map(Object.entries(b))];
  return (
    one.size === other.size && [...one].every(([name, value]) => other.has(name) && isSame(value, other.get(name)))
  );
}
