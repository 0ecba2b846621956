/** Texts and costs that the report template of the project proposes for a defect. */

import { ApiError, get } from '../server/api.js';
import { Store } from '../page/store.js';

/** @typedef {Api['Recommendation']} Proposal */

/**
 * A store of the template; without proposals and costs until they are known.
 * @extends {Store<Pick<Api['ReportTemplate'], 'recommendations'|'costs'|'currency'>>}
 */
export class Proposals extends Store {
  #path;
  #signal;
  /** Whether the template was asked for; it has a logo, so it is not read for each defect. */
  #isAsked = false;

  /**
   * @param {string} inspection
   * @param {AbortSignal} signal
   */
  constructor(inspection, signal) {
    super({ recommendations: [], costs: false, currency: '' });
    this.#path = `/api/inspections/${inspection}/report-template`;
    this.#signal = signal;
  }

  /** Reads them once; after a failure a person writes without proposals, and the next form reads again. */
  async loadPatiently() {
    if (this.#isAsked) return;
    this.#isAsked = true;
    try {
      this.set((await get(this.#path, this.#signal)).template);
    } catch (error) {
      this.#isAsked = false;
      if (error.name !== 'AbortError' && !(error instanceof ApiError)) throw error;
    }
  }

  /**
   * Returns the proposals for a defect, those for its very code first.
   * @param {{code: string|null, char1: string|null, severity: number|null}} defect
   * @returns {Proposal[]}
   */
  of(defect) {
    return this.value.recommendations
      .filter((one) => one.severity_from <= (defect.severity ?? 0))
      .filter((one) => [null, defect.code].includes(one.code) && [null, defect.char1].includes(one.char1))
      .sort((a, b) => nearness(b) - nearness(a));
  }
}

/** @param {Proposal} proposal */
const nearness = ({ code, char1 }) => Number(code !== null) + Number(char1 !== null);
