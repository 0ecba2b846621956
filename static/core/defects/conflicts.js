/** Changes overtaken by somebody else's change. The browser keeps each until a person decides. */

import { Store } from '../page/store.js';

/**
 * @typedef {object} Conflict
 * @property {string} id a new one each time that it is found
 * @property {'observation'|'header'|'corrections'} kind
 * @property {string} [about] id of the observation
 * @property {object|null} mine fields of the change that waits, null when it deletes
 * @property {object|null} theirs what is stored, null when it was deleted
 * @property {() => Promise<void>|void} keepMine replaces theirs
 * @property {() => Promise<void>|void} takeTheirs discards mine
 */

/**
 * A store of conflicts, the oldest first. Fires `open` (detail: a conflict) when a person wants to decide.
 * @extends {Store<Conflict[]>}
 */
export class Conflicts extends Store {
  constructor() {
    super([]);
  }

  /**
   * Sets the conflicts of a kind; a known one stays the same object.
   * @param {string} kind
   * @param {Conflict[]} found
   */
  state(kind, found) {
    const known = new Map(this.value.filter((one) => one.kind === kind).map((one) => [one.id, one]));
    if (found.length === known.size && found.every(({ id }) => known.has(id))) return;
    const others = this.value.filter((one) => one.kind !== kind);
    this.set([...others, ...found.map((one) => known.get(one.id) ?? one)]);
  }

  /** Returns the conflict about an observation, or undefined. @param {string} observation */
  about(observation) {
    return this.value.find(({ about }) => about === observation);
  }

  /** @param {Conflict} conflict */
  open(conflict) {
    this.dispatchEvent(new CustomEvent('open', { detail: conflict }));
  }
}
