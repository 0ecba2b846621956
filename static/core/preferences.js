/**
 * A person's choices for the page. The server stores them; this browser keeps a copy, so that the first
 * paint has the right language and the page works while the server is unreachable.
 */

import { ApiError, get, put } from './api.js';
import { recallMembers, remember } from './remembered.js';
import { Store } from './store.js';

const COPY = 'chainage.preferences';

/** What a digit key may give to a tag beside the code, in the order of the server. */
const UNSTATED = {
  char1: null, char2: null, severity: null, quant1: null, quant2: null, clock_from: null, clock_to: null,
};

/** Main codes of EN 13508-2 for the digit keys 1 to 9, the server's defaults. */
export const USUAL_CODES = ['BAB', 'BAC', 'BAF', 'BAJ', 'BBA', 'BBB', 'BBC', 'BBF', 'BDD'].map(
  (code) => ({ code, ...UNSTATED }),
);

/**
 * @typedef {object} Chosen
 * @property {string|null} language its code; null: the one of the browser
 * @property {'m'|'ft'} units
 * @property {{code: string, char1: string|null, char2: string|null}[]} quick_codes at most nine, each with what
 *     else is given to a tag: severity, quantities, clock
 * @property {boolean} single_keys whether letters, digits and signs are keys
 * @property {object[]} templates at most 26 more such codes, in the list that is reached from a typed code
 * @property {string|null} pack id of the code pack for new inspections, null: the built-in one
 */
const UNSET = { language: null, units: 'm', quick_codes: USUAL_CODES, single_keys: true, pack: null, templates: [] };

class Preferences extends Store {
  /** {name, role} of the logged-in person; null before the server has answered. */
  person = null;

  constructor() {
    super(recallMembers(COPY, UNSET));
  }

  /**
   * Fetches the server's preferences; returns whether the page must be drawn again with them. An
   * unreachable server changes nothing.
   * @param {AbortSignal} [signal]
   */
  async load(signal) {
    const asked = this.value;
    let me;
    try {
      me = await get('/api/me', signal);
    } catch (error) {
      if (error instanceof ApiError) return false;
      throw error;
    }
    this.person = { name: me.name, role: me.role };
    if (this.value !== asked) return false; // changed meanwhile
    this.keep(me.preferences);
    return JSON.stringify(this.value) !== JSON.stringify(asked);
  }

  /**
   * Changes some preferences here at once and then on the server; throws an ApiError when that refuses.
   * @param {Partial<Chosen>} changes
   */
  async save(changes) {
    this.keep(changes);
    await put('/api/me/preferences', this.value);
  }

  /** Changes some preferences in this browser only. */
  keep(changes) {
    const value = { ...this.value, ...changes };
    remember(COPY, value);
    this.set(value);
  }
}

export const preferences = new Preferences();

/** Returns the codes of all digit keys with another one for key `i + 1`; what is not stated of it is null. */
export function quickCodesWith(i, tag) {
  const all = USUAL_CODES.map((usual, k) => preferences.value.quick_codes[k] ?? usual);
  all[i] = templateOf(tag);
  return all;
}

/** Returns what is kept of a tag for other ones: its code and details, null for what is not stated. */
export const templateOf = (tag) =>
  Object.fromEntries(['code', ...Object.keys(UNSTATED)].map((name) => [name, tag[name] ?? null]));
