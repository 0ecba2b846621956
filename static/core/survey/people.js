/** Who else has the inspection open, and which defect each of them is editing. */

import { Store } from '../page/store.js';

/** @typedef {{name: string, editing: string|null}} Person editing: id of a defect */

/** A store of the others on this server; without a line to it, nobody. @extends {Store<Person[]>} */
export class People extends Store {
  #live;
  /** @type {string|null} */
  #editing = null;

  /** @param {import('../server/live.js').LiveFeed} live @param {AbortSignal} signal */
  constructor(live, signal) {
    super([]);
    this.#live = live;
    live.addEventListener('people', ({ detail }) => this.set(detail.others), { signal });
    live.addEventListener('state', () => (live.state === 'OPEN' ? this.#say() : this.set([])), { signal });
    this.#say();
  }

  /** States which defect is edited here, null for none. @param {string|null} id */
  edit(id) {
    if (id === this.#editing) return;
    this.#editing = id;
    this.#say();
  }

  /** @returns {[string, number][]} the names, each with the number of its pages */
  get names() {
    const counts = new Map();
    for (const { name } of this.value) counts.set(name, (counts.get(name) ?? 0) + 1);
    return [...counts];
  }

  /** @returns {string[]} names of those who edit a defect @param {string} id */
  editing(id) {
    return [...new Set(this.value.filter((person) => person.editing === id).map(({ name }) => name))];
  }

  #say() {
    this.#live.send({ type: 'here', editing: this.#editing });
  }
}
