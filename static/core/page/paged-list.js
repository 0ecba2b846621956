/** One page of a long list that the server searches, sorts and cuts; the address keeps what is shown. */

import { get, pause, poll } from '../server/api.js';
import { Store } from './store.js';

/** Pause after a typed letter before the server is asked. */
const SETTLE_S = 0.15;

/**
 * Holds the newest answer of the server, null before the first. Answers that arrive late, after a newer
 * question, are dropped.
 * @template {{total: number}} Answer
 * @extends {Store<Answer|null>}
 */
export class PagedList extends Store {
  #path;
  #signal;
  #asked = new AbortController();

  /**
   * @param {string} path
   * @param {object} options
   * @param {string[]} options.filters names of the parameters that choose and sort; the address has them too
   * @param {number} [options.limit] rows of a page
   * @param {AbortSignal} options.signal
   */
  constructor(path, { filters, limit = 50, signal }) {
    super(null);
    this.#path = path;
    this.#signal = signal;
    this.limit = limit;
    const query = new URLSearchParams(location.search);
    this.filters = Object.fromEntries(filters.map((name) => [name, query.get(name) ?? '']));
    const page = Math.floor(Number(query.get('page')));
    this.offset = page > 1 ? (page - 1) * limit : 0;
    signal.addEventListener('abort', () => this.#asked.abort());
  }

  /** Number of rows that fit, on all pages. */
  get total() {
    return this.value?.total ?? 0;
  }

  /** Whether anything narrows the list. */
  get isFiltered() {
    return Object.values(this.filters).some((value) => value !== '');
  }

  /**
   * Changes what is wanted, from its first page on, and asks the server once the person pauses.
   * @param {Record<string, string>} filters
   */
  async want(filters) {
    Object.assign(this.filters, filters);
    await this.#goTo(0, SETTLE_S);
  }

  /** Shows the page that begins with row `offset`. @param {number} offset */
  turnTo(offset) {
    return this.#goTo(offset, 0);
  }

  /** Asks the server for the present page. */
  async load() {
    const asked = this.#renewed();
    const answer = await get(`${this.#path}?${this.#query()}`, asked);
    const last = Math.max(0, Math.ceil(answer.total / this.limit) - 1) * this.limit;
    if (this.offset > last) {
      this.offset = last; // rows were removed
      this.#keepInAddress();
      await this.load();
    } else if (!asked.aborted) this.set(answer);
  }

  /** Asks for the present page; false if another question came in between, which has its own answer. */
  async again() {
    try {
      await this.load();
      return true;
    } catch (error) {
      if (error.name !== 'AbortError' || this.#signal.aborted) throw error;
      return false;
    }
  }

  /**
   * Asks now and again while the page is visible.
   * @param {(answer: Partial<Answer>) => number|null} pauseAfter seconds until the next time
   * @param {(error: import('../server/api.js').ApiError|null) => void} onError null after every success
   */
  follow(pauseAfter, onError) {
    const ask = async () => {
      if (await this.again()) onError(null);
      return pauseAfter(this.value ?? {});
    };
    return poll(ask, this.#signal, onError);
  }

  /** @param {number} offset @param {number} settleS */
  async #goTo(offset, settleS) {
    this.offset = offset;
    this.#keepInAddress();
    const asked = this.#renewed();
    await pause(settleS, asked);
    if (asked.aborted) return;
    await this.again();
  }

  #renewed() {
    this.#asked.abort();
    this.#asked = new AbortController();
    return this.#asked.signal;
  }

  #chosen() {
    return Object.entries(this.filters).filter(([, value]) => value !== '');
  }

  #query() {
    return new URLSearchParams([...this.#chosen(), ['offset', String(this.offset)], ['limit', String(this.limit)]]);
  }

  #keepInAddress() {
    const page = this.offset / this.limit + 1;
    const query = new URLSearchParams([...this.#chosen(), ...(page > 1 ? [['page', String(page)]] : [])]);
    history.replaceState(null, '', `${location.pathname}${query.size ? `?${query}` : ''}`);
  }
}
