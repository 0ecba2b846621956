/**
 * Remarks that a person is typing, by observation. This browser keeps them: a page may begin anew at any time, and
 * another one of the same inspection may be open.
 */

import { ofPerson, recall, remember } from '../page/remembered.js';
import { Store } from '../page/store.js';

/**
 * A store of the texts by observation.
 * @extends {Store<Record<string, string>>}
 */
export class RemarkDrafts extends Store {
  #key;
  #isKept = true;

  /** @param {string} inspection */
  constructor(inspection) {
    const key = ofPerson(`chainage.remarks.${inspection}`);
    super(recall(key, {}));
    this.#key = key;
  }

  get isEmpty() {
    return Object.keys(this.value).length === 0;
  }

  /** @returns {string} empty where nothing is being typed @param {string} observation */
  of(observation) {
    return this.value[observation] ?? '';
  }

  /** @param {string} text empty when it is sent or given up @param {string} observation */
  put(observation, text) {
    // Another page may have kept others since; what could not be kept is only here.
    const { [observation]: _, ...others } = this.#isKept
      ? recall(this.#key, /** @type {Record<string, string>} */ ({}))
      : this.value;
    const all = text ? { ...others, [observation]: text } : others;
    this.#isKept = remember(this.#key, Object.keys(all).length ? all : null);
    this.set(all);
  }
}
