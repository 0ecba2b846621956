/** Whether the client was notified of the severest defects: what the webhook of the server has done. */

import { ApiError, get } from './api.js';
import { Store } from './store.js';

const WAITING_MS = 2000;
const SETTLED_MS = 30_000;

/**
 * @typedef {object} Alert
 * @property {string} observation_id
 * @property {'waiting'|'told'|'withdrawn'|'given_up'} state
 * @property {string|null} told_at
 * @property {string|null} error
 */

/** A store of the last alert of each observation, by its id; empty where there is no client to be notified. */
export class Alerts extends Store {
  #path;
  #signal;
  #timer = 0;
  #round = 0;

  /**
   * @param {string} inspection
   * @param {AbortSignal} signal
   */
  constructor(inspection, signal) {
    super(new Map());
    this.#path = `/api/inspections/${inspection}/alerts`;
    this.#signal = signal;
    signal.addEventListener('abort', () => clearTimeout(this.#timer));
  }

  /** Whether anybody has asked. */
  get isFollowed() {
    return this.#round > 0;
  }

  /** Asks now, and again as long as somebody is still to be notified; a server that is away changes nothing. */
  async follow() {
    this.#round += 1;
    const round = this.#round;
    clearTimeout(this.#timer);
    try {
      const { is_configured: isConfigured, alerts } = await get(this.#path, this.#signal);
      if (round !== this.#round) return;
      this.set(new Map(alerts.map((alert) => [alert.observation_id, alert])));
      if (!isConfigured) return;
    } catch (error) {
      if (error.name === 'AbortError') return;
      if (!(error instanceof ApiError)) throw error;
      if (!error.isTemporary) return;
    }
    const isWaiting = [...this.value.values()].some(({ state }) => state === 'waiting');
    this.#timer = setTimeout(() => this.follow(), isWaiting ? WAITING_MS : SETTLED_MS);
  }
}
