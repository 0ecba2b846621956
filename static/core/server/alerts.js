/** Notifications of the severest defects by the server's webhook. */

import { get, refusalIn } from './api.js';
import { Store } from '../page/store.js';
import { wordFor } from '../page/words.js';

const WAITING_MS = 2000;
const SETTLED_MS = 30_000;

/**
 * Says why the client was not notified.
 * @param {Api['ReasonOut']|null} reason
 * @param {string|null} sentence the server's own, for a reason that this page does not know
 */
export const reasonText = (reason, sentence) =>
  (reason && wordFor('undelivered', reason.code, reason.values)) ?? sentence;

/**
 * A store of the last alert of each observation, by its id; empty where no client is configured.
 * @extends {Store<Map<string, Api['AlertOut']>>}
 */
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
      /** @type {Api['AlertsOut']} */
      const { is_configured: isConfigured, alerts } = await get(this.#path, this.#signal);
      if (round !== this.#round) return;
      this.set(new Map(alerts.map((alert) => [alert.observation_id, alert])));
      if (!isConfigured) return;
    } catch (error) {
      if (!refusalIn(error)) return;
      if (!error.isTemporary) return;
    }
    const isWaiting = [...this.value.values()].some(({ state }) => state === 'waiting');
    this.#timer = setTimeout(() => this.follow(), isWaiting ? WAITING_MS : SETTLED_MS);
  }
}
