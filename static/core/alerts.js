/** Notifications of the severest defects by the server's webhook. */

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

/** A store of the last alert of each observation, by its id; empty where no client is configured. */
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

  /** Whether `follow` was called. */
  get isFollowed() {
    return this.#round > 0;
  }

  /**
   * Fetches the alerts now, and repeatedly while some are waiting; an unreachable server changes nothing.
   */
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
