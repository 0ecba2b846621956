/** Remarks that are being typed, by observation. This browser keeps them: a page may begin anew at any time. */

import { recall, remember } from './remembered.js';
import { Store } from './store.js';

/** A store of the texts by observation. */
export class RemarkDrafts extends Store {
  #key;

  /** @param {string} inspection */
  constructor(inspection) {
    const key = `chainage.remarks.${inspection}`;
    super(recall(key, {}));
    this.#key = key;
  }

  get isEmpty() {
    return Object.keys(this.value).length === 0;
  }

  /** @returns {string} empty where nothing is being typed */
  of(observation) {
    return this.value[observation] ?? '';
  }

  /** @param {string} text empty when it is sent or given up */
  put(observation, text) {
    const { [observation]: _, ...others } = this.value;
    this.set(text ? { ...others, [observation]: text } : others);
    remember(this.#key, this.isEmpty ? null : this.value);
  }
}
