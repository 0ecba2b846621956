/**
 * Changes of observations on their way to the server.
 *
 * A change of an observation is based on the fields that the page showed, `before`. It may replace only
 * those: if somebody else has stored others meanwhile, the server refuses the change and a person decides.
 * A change may also be based on this browser's previous change, whichever tab has sent that one.
 */

import { post, put, remove } from './api.js';
import { Operations } from './operations.js';
import { StoredOutbox } from './stored-outbox.js';

const NAME = 'chainage-outbox';
/** A photo takes a few seconds. */
const ANSWER_LIMIT_S = 30;
/** Pause in typing after which text is sent; it is stored at every letter. */
const TYPED_S = 0.8;

/**
 * @typedef {import('../defects/observations.js').Fields} Fields
 * @typedef {Omit<Operation, 'id'>} New
 *
 * @typedef {import('./stored-outbox.js').Queued & Based} Operation
 *
 * @typedef {object} Based
 * @property {'save'|'delete'|'reject'|'reopen'} kind the last two are decisions about a finding
 * @property {Fields} [fields] of a save; all others leave none
 * @property {string} [finding] what the observation is made of, or what is decided about
 * @property {Partial<Fields>|null} [before] fields that the change is based on, null when there was no observation
 * @property {string|null} [version] of `before`; null while this browser's previous change is unanswered
 */

/** @extends {StoredOutbox<Operation>} */
export class Outbox extends StoredOutbox {
  /**
   * The state of each observation that the server last accepted: {fields, version}.
   * @type {Map<string, {fields: Fields|undefined, version: string}>}
   */
  #taken = new Map();
  #typedTimer = 0;

  /** Opens the outbox of this browser and sends what it still holds. */
  static async open() {
    const operations = /** @type {Operations<Operation>} */ (await Operations.open(NAME));
    return new Outbox(operations, await operations.all());
  }

  /** @param {Operations<Operation>} operations @param {Operation[]} known */
  constructor(operations, known) {
    super(NAME, operations, known, ANSWER_LIMIT_S);
  }

  /** @param {string} observation */
  isWaiting(observation) {
    return this.waiting.some((operation) => operation.observation === observation);
  }

  /** Resolves when the operation is safe in this browser; it is sent in the background. @param {New} operation */
  async add(operation) {
    await this.#keep(operation);
    this.flush();
  }

  /** Like `add`, for text that is still being typed: it is sent after a pause in typing. @param {New} operation */
  async addTyped(operation) {
    clearTimeout(this.#typedTimer);
    this.#typedTimer = setTimeout(() => this.flush(), 1000 * TYPED_S);
    await this.#keep(operation);
  }

  /** @param {New} operation */
  async #keep(operation) {
    const { observation } = operation;
    const last = this.known.findLast((other) => other.observation === observation);
    const isOfLast = last !== undefined && isSame(last.fields, operation.before);
    // An operation that may have arrived stays; its successor is then based on its result. What was deleted is
    // saved before, so that the history shows it.
    const isUnseen = isOfLast && operation.kind === 'save' && !last.isSent && last.id !== this.sending;
    // A refused operation is settled by its successor. Another tab may be sending the
    // replaced one just now, so its successor has its own id.
    const isReplaced = isUnseen || last?.refusal;
    const kept = isReplaced && isOfLast && { ...madeOf(last), ...(last.finding && { finding: last.finding }) };
    await this.put({ ...operation, ...kept }, isReplaced ? [last] : []);
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
    await this.put({ ...operation, ...(code === 'changed_meanwhile' && { before, version }) }, [refused]);
    this.flush();
  }

  /** Discards the refused change of an observation. @param {string} observation */
  drop(observation) {
    return this.discard(this.#refusedOf(observation));
  }

  /** @param {string} observation */
  #refusedOf(observation) {
    return this.known.filter((other) => other.observation === observation && other.refusal);
  }

  /** @param {Operation} operation @param {AbortSignal} signal */
  async deliver(operation, signal) {
    const { inspection, observation, fields, kind, finding, before } = operation;
    const path = `/api/inspections/${inspection}`;
    if (kind === 'reject' || kind === 'reopen') {
      await post(`${path}/findings/${finding}/${kind}`, undefined, signal);
      return null;
    }
    const answer =
      finding && !before
        ? await post(`${path}/findings/${finding}/accept`, { observation_id: observation, changes: fields }, signal)
        : await this.#replace(`${path}/observations/${observation}`, operation, signal);
    if (answer) this.#taken.set(observation, { fields, version: answer.version });
    return answer;
  }

  /**
   * Sends an operation that may replace only what it is based on.
   * @param {string} path
   * @param {Operation} operation
   * @param {AbortSignal} signal
   * @returns {Promise<Api['ObservationOut']|null>}
   */
  async #replace(path, { kind, observation, fields, before, version, isSent }, signal) {
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

  /** @param {Operation} operation @param {import('./api.js').ApiError} error */
  async refuse(operation, error) {
    const { id, observation, fields, before } = operation;
    const kept = await this.stored();
    const next = [...kept, ...this.known].find((other) => other.observation === observation && other.id > id);
    const isOfIt = next && isSame(next.before, fields);
    // The successor was based on the refused operation; now it is based on what that one was based on.
    if (isOfIt) await this.change(next.id, madeOf(operation));
    const isPassed = isOfIt || next?.kind === 'delete';
    const isNothing = error.isOvertaken && isSame(fields, before);
    if (isPassed || isNothing) await this.settle(operation, new Event('elsewhere'));
    else await super.refuse(operation, error);
    // A refused decision leaves nothing to decide: the finding is as it is stored.
    if (['reject', 'reopen'].includes(operation.kind))
      await this.discard(this.known.filter((other) => other.id === id));
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
