/**
 * A person's choices for the page. The server stores them; this browser keeps a copy, so that the first
 * paint has the right language and the page works while the server is unreachable.
 */

import { ApiError, get, put } from '../server/api.js';
import { recallMembers, remember } from './remembered.js';
import { Store } from './store.js';

const COPY = 'chainage.preferences';

/**
 * What a digit key may give to a tag beside the code, in the order of the server.
 * @type {Omit<Required<Api['QuickCode']>, 'code'>}
 */
const UNSTATED = {
  char1: null,
  char2: null,
  severity: null,
  quant1: null,
  quant2: null,
  clock_from: null,
  clock_to: null,
};

const QUICK = /** @type {(keyof Api['QuickCode'])[]} */ (['code', ...Object.keys(UNSTATED)]);

/** Main codes of EN 13508-2 for the digit keys 1 to 9, the server's defaults. @type {Required<Api['QuickCode']>[]} */
export const USUAL_CODES = ['BAB', 'BAC', 'BAF', 'BAJ', 'BBA', 'BBB', 'BBC', 'BBF', 'BDD'].map((code) => ({
  code,
  ...UNSTATED,
}));

/** @typedef {Api['PreferencesIn']} Chosen */

/** @type {Chosen} */
const UNSET = {
  language: null,
  units: 'm',
  quick_codes: USUAL_CODES,
  single_keys: true,
  keys: {},
  pack: null,
  templates: [],
};

/** @extends {Store<Chosen>} */
class Preferences extends Store {
  /**
   * {name, role} of the logged-in person; null before the server has answered.
   * @type {{name: string, role: string}|null}
   */
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
    return inOrder(this.value) !== inOrder(asked);
  }

  /**
   * Changes some preferences here at once and then on the server; throws an ApiError when that refuses.
   * @param {Partial<Chosen>} changes
   */
  async save(changes) {
    this.keep(changes);
    await put('/api/me/preferences', this.value);
  }

  /** Changes some preferences in this browser only. @param {Partial<Chosen>} changes */
  keep(changes) {
    const value = { ...this.value, ...changes };
    remember(COPY, value);
    this.set(value);
  }
}

/** Returns JSON whose members stand in one order, as the server may send them in any. @param {Chosen} chosen */
const inOrder = (chosen) =>
  JSON.stringify(chosen, (_, part) =>
    part?.constructor === Object ? Object.fromEntries(Object.entries(part).sort()) : part,
  );

export const preferences = new Preferences();

/**
 * Returns the codes of all digit keys with another one for key `i + 1`; what is not stated of it is null.
 * @param {number} i
 * @param {Partial<Api['QuickCode']>} tag
 */
export function quickCodesWith(i, tag) {
  const all = USUAL_CODES.map((usual, k) => preferences.value.quick_codes[k] ?? usual);
  all[i] = templateOf(tag);
  return all;
}

/**
 * Returns what is kept of a tag for other ones: its code and details, null for what is not stated.
 * @param {Partial<Api['QuickCode']>} tag
 * @returns {Required<Api['QuickCode']>}
 */
export const templateOf = (tag) =>
  /** @type {any} */ (Object.fromEntries(QUICK.map((name) => [name, tag[name] ?? null])));
