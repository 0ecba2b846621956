/** The review of one inspection: how its state was reached, and what was said about its defects. */

import { get, post, put, remove } from './api.js';
import { may } from './rights.js';
import { Store } from './store.js';
import { t } from './words.js';

/** The states that may follow each one. */
const NEXT = {
  draft: ['submitted'],
  submitted: ['in_review', 'reopened'],
  in_review: ['approved', 'reopened'],
  approved: ['reopened'],
  reopened: ['submitted'],
};

export const STATES = Object.keys(NEXT);

export const nextStates = (state) => NEXT[state];

/** Whether an inspection is approved, so that nobody changes it. */
export const isLocked = ({ review }) => review.state === 'approved';

/** Returns why the person may not change the inspection of the page. */
export const whyLocked = () => (may('operator') ? t('desk.approved') : t('rights.viewer'));

/** Whether only admins may take a step: into the lock, and out of it. */
export const isForAdmins = (state, wanted) => state === 'approved' || wanted === 'approved';

/** Whether a remark is a question that waits for an answer. */
export const isOpen = ({ kind, settled_at: settled }) => kind === 'question' && !settled;

/**
 * Holds the answer of the server, null until it is read.
 * @typedef {object} Remark
 * @property {string} id
 * @property {string} observation
 * @property {'accepted'|'question'|'comment'} kind
 * @property {string} text
 * @property {string} version that of the observation when the remark was made
 */
export class Review extends Store {
  #path;
  #signal;
  #running = Promise.resolve();

  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/review`;
    this.#signal = signal;
  }

  /** By observation. */
  #about = new Map();

  #take(answer) {
    this.#about.clear();
    for (const remark of answer.remarks) {
      this.#about.set(remark.observation, [...this.about(remark.observation), remark]);
    }
    this.set(answer);
  }

  load() {
    return this.#inTurn(() => get(this.#path, this.#signal));
  }

  /** @returns {Remark[]} about an observation, the oldest first */
  about(observation) {
    return this.#about.get(observation) ?? [];
  }

  /** @returns {Remark[]} */
  get questions() {
    return (this.value?.remarks ?? []).filter(isOpen);
  }

  /** Whether an observation was accepted as it is now. */
  isAccepted({ id, version }) {
    return this.about(id).some((remark) => remark.kind === 'accepted' && remark.version === version);
  }

  move(state, reason) {
    return this.#inTurn(() => post(this.#path, { state, reason }));
  }

  /** `version`: that of the observation that the person saw; when another one is stored by now, nothing is said. */
  say({ id, observation, kind, text, version }) {
    return this.#inTurn(() => put(`${this.#path}/remarks/${id}`, { observation, kind, text, version }));
  }

  settle(id, settled) {
    return this.#inTurn(() => put(`${this.#path}/remarks/${id}/settled`, { settled }));
  }

  withdraw(id) {
    return this.#inTurn(() => remove(`${this.#path}/remarks/${id}`));
  }

  /** Sends requests one after the other, so that the answer of the last one is the newest. */
  #inTurn(send) {
    const result = this.#running.then(send).then((answer) => this.#take(answer));
    this.#running = result.catch(() => {}); // the caller handles its failure
    return result;
  }
}
