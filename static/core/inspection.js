/** One inspection as the server last described it, and what can be done with it. */

import { get, post } from './api.js';
import { Store } from './store.js';

/** Whether the server still works on it. */
export const isUnfinished = ({ status }) => status === 'queued' || status === 'running';

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

  async cancel() {
    await post(`${this.#path}/cancel`);
    await this.load();
  }

  async retry() {
    await post(`${this.#path}/retry`);
    await this.load();
  }
}
