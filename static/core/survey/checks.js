/** The issues that stand against a report of one inspection. */

import { get, refusalIn } from '../server/api.js';
import { Store } from '../page/store.js';

/** Many changes at once cause one check. */
const PAUSE_MS = 700;

/** A store of issues, blocking ones first; null until they are known. @extends {Store<Api['IssueOut'][]|null>} */
export class Checks extends Store {
  #path;
  #signal;
  #timer = 0;
  #round = 0;

  /** @param {string} inspection @param {AbortSignal} signal */
  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/checks`;
    this.#signal = signal;
    signal.addEventListener('abort', () => clearTimeout(this.#timer));
  }

  async load() {
    this.#round += 1;
    const round = this.#round;
    const { checks } = await get(this.#path, this.#signal);
    if (round === this.#round) this.set(checks);
  }

  /** Checks again soon, after a relevant change. */
  loadSoon() {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#loadPatiently(), PAUSE_MS);
  }

  /** Loads the issues; a temporary failure waits for the next change. */
  async #loadPatiently() {
    try {
      await this.load();
    } catch (error) {
      refusalIn(error);
    }
  }
}
