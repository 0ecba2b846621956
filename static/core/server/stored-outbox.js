/**
 * Operations on their way to the server. Each is written to IndexedDB before it is sent and removed when the server
 * has answered, so a reload, a crash or a restart of the server loses none. They are sent in order, one at a time, by
 * one tab at a time, and every one may be sent twice. A refused one stays here until the person has edited or
 * discarded it.
 */

import { ApiError } from './api.js';
import { idInTime } from '../page/new-id.js';
import { errorText } from '../page/words.js';

/** Pauses before what could not be sent is sent again. */
const PAUSES_S = [0.5, 1, 2, 5, 10];

/**
 * @typedef {object} Queued
 * @property {string} id sorts by time of creation
 * @property {string} inspection
 * @property {string} observation
 * @property {string} kind 'delete' of something that is gone already is done
 * @property {boolean} [isSent] whether it may have arrived
 * @property {Refusal|null} [refusal] why the server refuses it
 *
 * @typedef {object} Refusal
 * @property {string} code
 * @property {string} message
 * @property {Api['ObservationOut']|null} current fields stored instead of those that an overtaken change is based on
 * @property {string|null} version of `current`
 */

/**
 * Events: `change` (`count`, `reason` or `isKept` has changed), `answered` (detail {operation, answer}),
 * `refused` (detail {operation, error}), `elsewhere` (the list must be read again: another tab has changed or
 * sent something, or a change was dropped without effect).
 * @template {Queued} Operation
 */
export class StoredOutbox extends EventTarget {
  /** What prevents the first operation from being sent, or null. @type {string|null} */
  reason = null;
  /** All stored operations, oldest first. @type {Operation[]} */
  known;
  /** Id of the operation that is being sent. @type {string|null} */
  sending = null;

  #name;
  #operations;
  /** Time after which a silent server counts as unreachable. */
  #limitS;
  #others;
  #written = Promise.resolve();
  #isFlushing = false;
  /** Whether something was added while the last was being sent. */
  #isAsked = false;
  #failures = 0;
  #timer = 0;

  /**
   * @param {string} name of the outbox in this browser
   * @param {import('./operations.js').Operations<Operation>} operations
   * @param {Operation[]} known those that it holds
   * @param {number} limitS
   * @param {AbortSignal} [signal] without it the outbox lasts as long as the page
   */
  constructor(name, operations, known, limitS, signal) {
    super();
    this.#name = name;
    this.#operations = operations;
    this.known = known;
    this.#limitS = limitS;
    this.#others = new BroadcastChannel(name);
    this.#others.onmessage = ({ data }) => (data ? this.#noteSent(data.sent) : this.#readAgain());
    addEventListener('online', () => this.flush(), { signal });
    addEventListener('beforeunload', (event) => !this.isKept && this.count && event.preventDefault(), { signal });
    signal?.addEventListener('abort', () => {
      clearTimeout(this.#timer);
      this.#others.close();
    });
    this.flush();
  }

  /** Number of operations that wait for the server. */
  get count() {
    return this.waiting.length;
  }

  get waiting() {
    return this.known.filter(({ refusal }) => !refusal);
  }

  /** Whether everything here survives the page; without storage in the browser it does not. */
  get isKept() {
    return this.#operations.isKept;
  }

  /**
   * Returns the operations of one inspection that the server has not accepted, oldest first.
   * @param {string} inspection
   */
  openFor(inspection) {
    return this.known.filter((operation) => operation.inspection === inspection);
  }

  /**
   * Resolves when no operation of an inspection is waiting, or when `signal` aborts.
   * @param {string} inspection
   * @param {AbortSignal} signal
   */
  async whenSent(inspection, signal) {
    while (this.waiting.some((operation) => operation.inspection === inspection) && !signal.aborted) {
      await new Promise((resolve) => {
        this.addEventListener('change', resolve, { once: true, signal });
        signal.addEventListener('abort', resolve, { once: true });
      });
    }
  }

  /** Sends now; what fails is sent again after a pause. */
  async flush() {
    this.#isAsked = true;
    if (this.#isFlushing) return;
    this.#isFlushing = true;
    clearTimeout(this.#timer);
    try {
      while (this.#isAsked) {
        this.#isAsked = false;
        await alone(this.#name, () => this.#sendAll());
      }
    } finally {
      this.#isFlushing = false;
    }
    if (this.reason === null) return;
    const seconds = PAUSES_S[Math.min(this.#failures, PAUSES_S.length - 1)];
    this.#failures += 1;
    this.#timer = setTimeout(() => this.flush(), seconds * 1000);
  }

  /**
   * Adds an operation in place of others that it settles; resolves when it is safe in this browser.
   * @param {Omit<Operation, 'id'>} operation
   * @param {Operation[]} [replaced]
   */
  async put(operation, replaced = []) {
    const added = /** @type {Operation} */ ({ id: idInTime(), ...operation });
    const [first, ...others] = replaced;
    this.known = [...this.known.filter((other) => !replaced.includes(other)), added];
    this.#written = this.#operations.put(added, first?.id);
    this.changed();
    await this.#written;
    for (const { id } of others) await this.#operations.delete(id);
    this.changed();
    this.tellOthers();
  }

  /** Discards refused operations. @param {Operation[]} dropped */
  async discard(dropped) {
    this.known = this.known.filter((other) => !dropped.includes(other));
    for (const { id } of dropped) await this.#operations.delete(id);
    this.tellOthers();
    this.changed();
  }

  /** @param {string} id @param {Partial<Operation>} changes */
  change(id, changes) {
    this.known = this.known.map((other) => (other.id === id ? { ...other, ...changes } : other));
    return this.#operations.update(id, changes);
  }

  /** Another tab is sending it. @param {string} id */
  #noteSent(id) {
    this.known = this.known.map((other) => (other.id === id ? { ...other, isSent: true } : other));
  }

  /** All operations, those of other tabs too. */
  stored() {
    return this.#operations.all();
  }

  /**
   * Whether it may be sent now.
   * @param {Operation} operation
   */
  isReady({ refusal }) {
    return !refusal;
  }

  /**
   * Sends an operation; returns what the server has stored, null after a delete.
   * @param {Operation} _operation
   * @param {AbortSignal} _signal
   * @returns {Promise<any>}
   */
  deliver(_operation, _signal) {
    throw new Error('Each kind of outbox delivers in its own way.');
  }

  /** Sends the stored operations, not those that this tab last saw: another tab may have sent some. */
  async #sendAll() {
    for (;;) {
      await this.#written;
      const operation = (await this.stored()).find((each) => this.isReady(each));
      if (!operation) break;
      this.sending = operation.id;
      try {
        if (await this.#mark(operation.id)) await this.#send(operation);
      } finally {
        this.sending = null;
      }
      if (this.reason) return;
      this.#failures = 0;
    }
    this.reason = null;
    await this.#read();
  }

  /**
   * Notes that an operation may arrive from now on; false when something took its place just now.
   * @param {string} id
   */
  async #mark(id) {
    const isThere = await this.change(id, /** @type {Partial<Operation>} */ ({ isSent: true }));
    this.#others.postMessage({ sent: id });
    return isThere;
  }

  /** @param {Operation} operation */
  async #send(operation) {
    let answer = null;
    try {
      answer = await this.deliver(operation, AbortSignal.timeout(this.#limitS * 1000));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.isForLater) {
        this.reason = errorText(error);
        this.changed();
        return;
      }
      const isGone = operation.kind === 'delete' && error.status === 404;
      if (!isGone) {
        await this.refuse(operation, error);
        return;
      }
    }
    await this.settle(operation, new CustomEvent('answered', { detail: { operation, answer } }));
  }

  /** Keeps an operation with the reason of its refusal. @param {Operation} operation @param {ApiError} error */
  async refuse(operation, error) {
    const { code, message, current, version } = error;
    const refused = /** @type {Partial<Operation>} */ ({ refusal: { code, message, current, version } });
    await this.change(operation.id, refused);
    this.#notify(new CustomEvent('refused', { detail: { operation, error } }));
  }

  /** Removes an operation and notifies. @param {Operation} operation @param {Event} event */
  async settle(operation, event) {
    await this.#operations.delete(operation.id);
    this.known = this.known.filter(({ id }) => id !== operation.id);
    this.#notify(event);
  }

  /** @param {Event} event */
  #notify(event) {
    this.reason = null;
    this.dispatchEvent(event);
    this.changed();
    this.tellOthers();
  }

  tellOthers() {
    this.#others.postMessage(null);
  }

  changed() {
    this.dispatchEvent(new Event('change'));
  }

  async #readAgain() {
    await this.#read();
    this.dispatchEvent(new Event('elsewhere'));
    if (this.count) this.flush();
  }

  /** Reads the operations again: other tabs have added or removed some. */
  async #read() {
    let seen;
    let all;
    do {
      seen = this.known;
      await this.#written;
      all = await this.stored();
    } while (seen !== this.known); // something was added meanwhile
    this.known = all;
    this.changed();
  }
}

/**
 * Runs `send` while no other tab does. Over plain http, where locks are missing, at once.
 * @param {string} name
 * @param {() => Promise<void>} send
 */
const alone = (name, send) => (navigator.locks ? navigator.locks.request(name, send) : send());
