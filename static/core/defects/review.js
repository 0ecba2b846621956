/** The review of one inspection: how its state was reached, and what was said about its defects. */

import { get, post, put, remove } from '../server/api.js';
import { may } from '../page/rights.js';
import { Store } from '../page/store.js';
import { t } from '../page/words.js';

/**
 * @typedef {Api['ReviewStateOut']['state']} State
 * @typedef {Api['RemarkOut']} Remark
 */

/** The states that may follow each one. @type {Record<State, State[]>} */
const NEXT = {
  draft: ['submitted'],
  submitted: ['in_review', 'reopened'],
  in_review: ['approved', 'reopened'],
  approved: ['reopened'],
  reopened: ['submitted'],
};

export const STATES = /** @type {State[]} */ (Object.keys(NEXT));

/** @param {State} state */
export const nextStates = (state) => NEXT[state];

/** Whether an inspection is approved, so that nobody changes it. @param {{review: {state: State}}} inspection */
export const isLocked = ({ review }) => review.state === 'approved';

/** Returns why the person may not change the inspection of the page. */
export const whyLocked = () => (may('operator') ? t('desk.approved') : t('rights.viewer'));

/** Whether only admins may take a step: into the lock, and out of it. @param {State} state @param {State} wanted */
export const isForAdmins = (state, wanted) => state === 'approved' || wanted === 'approved';

/** Whether a remark is a question that waits for an answer. @param {Remark} remark */
export const isOpen = ({ kind, settled_at: settled }) => kind === 'question' && !settled;

/** Whether a client waits for a reply. @param {Api['ClientAnswerOut']} answer */
export const isAsked = ({ kind, reply }) => kind === 'question' && reply === null;

/**
 * Holds the answer of the server, null until it is read.
 * @extends {Store<Api['ReviewOut']|null>}
 */
export class Review extends Store {
  #path;
  #signal;
  #running = Promise.resolve();

  /** @param {string} inspection @param {AbortSignal} signal */
  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/review`;
    this.#signal = signal;
  }

  /** By observation. @type {Map<string, Remark[]>} */
  #about = new Map();

  /** @param {Api['ReviewOut']} answer */
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

  /** @returns {Remark[]} about an observation, the oldest first @param {string} observation */
  about(observation) {
    return this.#about.get(observation) ?? [];
  }

  /** @returns {Remark[]} */
  get questions() {
    return (this.value?.remarks ?? []).filter(isOpen);
  }

  /** Number of questions that wait, of reviewers and of clients. */
  get waiting() {
    return this.questions.length + (this.value?.said ?? []).filter(isAsked).length;
  }

  /** Whether an observation was accepted as it is now. @param {{id: string, version?: string|null}} observation */
  isAccepted({ id, version }) {
    return this.about(id).some((remark) => remark.kind === 'accepted' && remark.version === version);
  }

  /** @param {State} state @param {string|null} [reason] */
  move(state, reason) {
    return this.#inTurn(() => post(this.#path, { state, reason }));
  }

  /**
   * `version`: that of the observation that the person saw; when another one is stored by now, nothing is said.
   * @param {Api['RemarkIn'] & {id: string}} remark
   */
  say({ id, observation, kind, text, version }) {
    return this.#inTurn(() => put(`${this.#path}/remarks/${id}`, { observation, kind, text, version }));
  }

  /** @param {string} id @param {boolean} settled */
  settle(id, settled) {
    return this.#inTurn(() => put(`${this.#path}/remarks/${id}/settled`, { settled }));
  }

  /** Answers a client. @param {string} id @param {string} reply */
  reply(id, reply) {
    return this.#inTurn(() => put(`${this.#path}/said/${id}`, { reply }));
  }

  /** @param {string} id */
  withdraw(id) {
    return this.#inTurn(() => remove(`${this.#path}/remarks/${id}`));
  }

  /**
   * Sends requests one after the other, so that the answer of the last one is the newest.
   * @param {() => Promise<Api['ReviewOut']>} send
   */
  #inTurn(send) {
    const result = this.#running.then(send).then((answer) => this.#take(answer));
    this.#running = result.catch(() => {}); // the caller handles its failure
    return result;
  }
}
