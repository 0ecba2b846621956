/**
 * Changes of observations on their way to the server. Each is written to IndexedDB before it is
 * sent and removed when the server has answered, so a reload, a crash or a restart of the server
 * loses none. They are sent in order, one at a time, by one tab at a time, and every one may be sent
 * twice. A refused change stays here until the person has edited or discarded it.
 *
 * A change of an observation is based on the fields that the page showed, `before`. It may replace only
 * those: if somebody else has stored others meanwhile, the server refuses the change and a person decides.
 * A change may also be based on this browser's previous change, whichever tab has sent that one.
 */

import { ApiError, put, remove } from './api.js';
import { idInTime } from '../page/new-id.js';
import { Operations } from './operations.js';
import { Sender } from './sending.js';
import { errorText } from '../page/words.js';

const NAME = 'chainage-outbox';
/** Time after which a silent server counts as unreachable; a photo takes a few seconds. */
const ANSWER_LIMIT_S = 30;
/** Pause in typing after which text is sent; it is stored at every letter. */
const TYPED_S = 0.8;

/**
 * @typedef {import('../defects/observations.js').Fields} Fields
 * @typedef {Omit<Operation, 'id'>} New
 *
 * @typedef {object} Operation
 * @property {string} id sorts by time of creation
 * @property {string} inspection
 * @property {string} observation
 * @property {'save'|'delete'} kind
 * @property {Fields} [fields] of a save; a delete leaves none
 * @property {Partial<Fields>|null} [before] fields that the change is based on, null when there was no observation
 * @property {string|null} [version] of `before`; null while this browser's previous change is unanswered
 * @property {boolean} [isSent] whether it may have arrived
 * @property {Refusal} [refusal] why the server refuses it
 *
 * @typedef {object} Refusal
 * @property {string} code
 * @property {string} message
 * @property {Api['ObservationOut']|null} current fields stored instead of `before`, when the change was overtaken
 * @property {string|null} version of `current`
 */

/**
 * Events: `change` (`count`, `reason` or `isKept` has changed), `answered` (detail {operation, answer}),
 * `refused` (detail {operation, error}), `elsewhere` (the list must be read again: another tab has changed or
 * sent something, or a change was dropped without effect).
 */
export class Outbox extends EventTarget {
  /** What prevents the first operation from being sent, or null. @type {string|null} */
  reason = null;

  #operations;
  /** All stored operations, oldest first. @type {Operation[]} */
  #known;
  /** Id of the operation that is being sent. @type {string|null} */
  #sending = null;
  /**
   * The state of each observation that the server last accepted: {fields, version}.
   * @type {Map<string, {fields: Fields|undefined, version: string}>}
   */
  #taken = new Map();
  #written = Promise.resolve();
  #typedTimer = 0;
  #others = new BroadcastChannel(NAME);
  #sender = new Sender(
    NAME,
    () => this.#sendAll(),
    () => this.reason !== null,
  );

  /** Opens the outbox of this browser and sends what it still holds. */
  static async open() {
    const operations = /** @type {Operations<Operation>} */ (await Operations.open(NAME));
    return new Outbox(operations, await operations.all());
  }

  /** @param {Operations<Operation>} operations @param {Operation[]} known */
  constructor(operations, known) {
    super();
    this.#operations = operations;
    this.#known = known;
    this.#others.onmessage = ({ data }) => (data ? this.#note(data.sent, { isSent: true }) : this.#readAgain());
    addEventListener('online', () => this.#sender.flush());
    addEventListener('beforeunload', (event) => {
      if (!this.isKept && this.count) event.preventDefault();
    });
    this.#sender.flush();
  }

  /** Number of operations that wait for the server. */
  get count() {
    return this.#waiting.length;
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
    return this.#known.filter((operation) => operation.inspection === inspection);
  }

  /** @param {string} observation */
  isWaiting(observation) {
    return this.#waiting.some((operation) => operation.observation === observation);
  }

  /** Resolves when the operation is safe in this browser; it is sent in the background. @param {New} operation */
  async add(operation) {
    await this.#keep(operation);
    this.#sender.flush();
  }

  /** Like `add`, for text that is still being typed: it is sent after a pause in typing. @param {New} operation */
  async addTyped(operation) {
    clearTimeout(this.#typedTimer);
    this.#typedTimer = setTimeout(() => this.#sender.flush(), 1000 * TYPED_S);
    await this.#keep(operation);
  }

  /** @param {New} operation */
  async #keep(operation) {
    const { observation } = operation;
    const last = this.#known.findLast((other) => other.observation === observation);
    const isOfLast = last !== undefined && isSame(last.fields, operation.before);
    // An operation that may have arrived stays; its successor is then based on its result. What was deleted is
    // saved before, so that the history shows it.
    const isUnseen = isOfLast && operation.kind === 'save' && !last.isSent && last.id !== this.#sending;
    // A refused operation is settled by its successor. Another tab may be sending the
    // replaced one just now, so its successor has its own id.
    const replaced = isUnseen || last?.refusal ? last : null;
    await this.#put({ ...operation, ...(replaced && isOfLast && madeOf(last)) }, replaced);
  }

  /**
   * Adds an operation, replacing another one if there is one.
   * @param {New} operation
   * @param {Operation|null} [replaced]
   */
  async #put(operation, replaced) {
    const added = { id: idInTime(), ...operation };
    this.#known = [...this.#known.filter((other) => other !== replaced), added];
    this.#written = this.#operations.put(added, replaced?.id);
    this.#changed();
    await this.#written;
    this.#changed();
    this.#others.postMessage(null);
  }

  /** Returns the overtaken operations of one inspection. @param {string} inspection */
  overtakenFor(inspection) {
    return this.openFor(inspection).filter(({ refusal }) => refusal?.code === 'changed_meanwhile');
  }

  /** Sends the refused change of an observation again, to replace the other version. @param {string} observation */
  async sendAgain(observation) {
    const refused = this.#refusedOf(observation).at(-1);
    if (!refused) return; // settled in another tab
    const { refusal, isSent: _, id: _id, ...operation } = refused;
    const { code, current: before, version } = refusal;
    await this.#put({ ...operation, ...(code === 'changed_meanwhile' && { before, version }) }, refused);
    this.#sender.flush();
  }

  /** @param {string} observation */
  #refusedOf(observation) {
    return this.#known.filter((other) => other.observation === observation && other.refusal);
  }

  /** Discards the refused change of an observation. @param {string} observation */
  async drop(observation) {
    const refused = this.#refusedOf(observation);
    this.#known = this.#known.filter((other) => !refused.includes(other));
    for (const { id } of refused) await this.#operations.delete(id);
    this.#others.postMessage(null);
    this.#changed();
  }

  get #waiting() {
    return this.#known.filter(({ refusal }) => !refusal);
  }

  /** Sends the stored operations, not those that this tab last saw: another tab may have sent some. */
  async #sendAll() {
    for (;;) {
      await this.#written;
      const operation = (await this.#operations.all()).find(({ refusal }) => !refusal);
      if (!operation) break;
      this.#sending = operation.id;
      try {
        if (await this.#mark(operation.id)) await this.#sendOne(operation);
      } finally {
        this.#sending = null;
      }
      if (this.reason) return;
      this.#sender.arrived();
    }
    this.reason = null;
    await this.#read();
  }

  /**
   * Notes that an operation may arrive from now on; false when something took its place just now.
   * @param {string} id
   */
  async #mark(id) {
    const isThere = await this.#change(id, { isSent: true });
    this.#others.postMessage({ sent: id });
    return isThere;
  }

  /** @param {string} id @param {Partial<Operation>} changes */
  #change(id, changes) {
    this.#note(id, changes);
    return this.#operations.update(id, changes);
  }

  /** @param {string} id @param {Partial<Operation>} changes */
  #note(id, changes) {
    this.#known = this.#known.map((other) => (other.id === id ? { ...other, ...changes } : other));
  }

  /** @param {Operation} operation */
  async #sendOne(operation) {
    const path = `/api/inspections/${operation.inspection}/observations/${operation.observation}`;
    let answer = null;
    try {
      const limit = AbortSignal.timeout(ANSWER_LIMIT_S * 1000);
      answer = await this.#deliver(path, operation, limit);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.isForLater) {
        this.reason = errorText(error);
        this.#changed();
        return;
      }
      const isGone = operation.kind === 'delete' && error.status === 404;
      if (!isGone) {
        await this.#refused(operation, error);
        return;
      }
    }
    if (answer) this.#taken.set(operation.observation, { fields: operation.fields, version: answer.version });
    await this.#settle(operation, new CustomEvent('answered', { detail: { operation, answer } }));
  }

  /**
   * Sends an operation; returns the stored observation, null after a delete.
   * @param {string} path
   * @param {Operation} operation
   * @param {AbortSignal} signal
   * @returns {Promise<Api['ObservationOut']|null>}
   */
  async #deliver(path, { kind, observation, fields, before, version, isSent }, signal) {
    const isDelete = kind === 'delete';
    /** @param {string} [replaced] */
    const send = (replaced) => (isDelete ? remove(path, signal, replaced) : put(path, fields, signal, replaced));
    if (!before && (isDelete || !isSent)) return send();
    const taken = this.#taken.get(observation);
    const replaced = taken && isSame(taken.fields, before) ? taken.version : version;
    try {
      return await send(replaced ?? '');
    } catch (error) {
      // Only the version is unknown: this browser's own change has arrived, before a reload or from another tab.
      if (!error.isOvertaken || !isSame(error.current, before)) throw error;
      return send(error.version);
    }
  }

  /** @param {Operation} operation @param {ApiError} error */
  async #refused(operation, error) {
    const { id, observation, fields, before } = operation;
    const kept = await this.#operations.all();
    const next = [...kept, ...this.#known].find((other) => other.observation === observation && other.id > id);
    const isOfIt = next && isSame(next.before, fields);
    // The successor was based on the refused operation; now it is based on what that one was based on.
    if (isOfIt) await this.#change(next.id, madeOf(operation));
    const isPassed = isOfIt || next?.kind === 'delete';
    const isNothing = error.isOvertaken && isSame(fields, before);
    if (isPassed || isNothing) {
      await this.#settle(operation, new Event('elsewhere'));
      return;
    }
    const { code, message, current, version } = error;
    await this.#change(id, { refusal: { code, message, current, version } });
    this.#notify(new CustomEvent('refused', { detail: { operation, error } }));
  }

  /** Removes an operation and notifies. @param {Operation} operation @param {Event} event */
  async #settle(operation, event) {
    await this.#operations.delete(operation.id);
    this.#known = this.#known.filter(({ id }) => id !== operation.id);
    this.#notify(event);
  }

  /** @param {Event} event */
  #notify(event) {
    this.reason = null;
    this.dispatchEvent(event);
    this.#changed();
    this.#others.postMessage(null);
  }

  async #readAgain() {
    await this.#read();
    this.dispatchEvent(new Event('elsewhere'));
    if (this.count) this.#sender.flush();
  }

  /** Reads the operations again: other tabs have added or removed some. */
  async #read() {
    let seen;
    let all;
    do {
      seen = this.#known;
      await this.#written;
      all = await this.#operations.all();
    } while (seen !== this.#known); // something was added meanwhile
    this.#known = all;
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}

/** Returns what an operation is based on, for its successor. @param {Partial<Operation>} operation */
const madeOf = ({ before = null, version = null }) => ({ before, version });

/**
 * Whether two sets of fields state the same; null means not stated.
 * @param {object|null|undefined} a
 * @param {object|null|undefined} b
 */
const isSame = (a, b) => statedIn(a) === statedIn(b);

/** @param {object|null|undefined} fields */
const statedIn = (fields) =>
  JSON.stringify(
    Object.entries(fields ?? {})
      .filter(([, value]) => value !== null)
      .sort(),
  );
