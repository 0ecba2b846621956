/**
 * Attachments on their way to the server: photos of frames, drawings, voice notes, and their deletion. Like
 * the changes of the outbox they are in IndexedDB from the moment they are made until the server has
 * answered, are sent in order by one tab at a time, and may be sent twice. They wait for their observation.
 */

import { ApiError, bodyOf, post, put, remove, send } from './api.js';
import { idInTime } from '../page/new-id.js';
import { Operations } from './operations.js';
import { Sender } from './sending.js';
import { errorText } from '../page/words.js';

const NAME = 'chainage-attachments';
/** Time after which a silent server counts as unreachable; a voice note of 1 MB takes its time. */
const ANSWER_LIMIT_S = 60;

/**
 * @typedef {object} Operation
 * @property {string} id sorts by time of creation
 * @property {string} inspection
 * @property {string} observation
 * @property {string} attachment
 * @property {'put'|'voice'|'delete'|'restore'} kind
 * @property {import('../defects/attachments.js').Shown} [shown] the attachment as the page shows it meanwhile; none of a delete
 * @property {object} [body] of a put
 * @property {Blob} [sound] of a voice note
 * @property {{code: string, message: string}|null} [refusal] why the server refuses it
 */

/**
 * Events: `change`, `answered` (detail {operation, answer}), `refused` (detail {operation, error}), and
 * `elsewhere`: the list must be read again.
 */
export class AttachmentOutbox extends EventTarget {
  /** What prevents the first operation from being sent, or null. @type {string|null} */
  reason = null;

  #operations;
  /** @type {Operation[]} */
  #known;
  /** The outbox of the observations. */
  #tags;
  #others = new BroadcastChannel(NAME);
  #sender = new Sender(
    NAME,
    () => this.#sendAll(),
    () => this.reason !== null,
  );

  /**
   * Opens the outbox of this browser and sends what it still holds.
   * @param {import('./outbox.js').Outbox} tags
   * @param {AbortSignal} signal
   */
  static async open(tags, signal) {
    const operations = /** @type {Operations<Operation>} */ (await Operations.open(NAME));
    return new AttachmentOutbox(operations, await operations.all(), tags, signal);
  }

  /**
   * @param {Operations<Operation>} operations
   * @param {Operation[]} known
   * @param {import('./outbox.js').Outbox} tags
   * @param {AbortSignal} signal
   */
  constructor(operations, known, tags, signal) {
    super();
    this.#operations = operations;
    this.#known = known;
    this.#tags = tags;
    this.#others.onmessage = () => this.#readAgain();
    tags.addEventListener('change', () => this.count && this.#sender.flush(), { signal });
    addEventListener('online', () => this.#sender.flush(), { signal });
    addEventListener(
      'beforeunload',
      (event) => {
        if (!this.#operations.isKept && this.count) event.preventDefault();
      },
      { signal },
    );
    signal.addEventListener('abort', () => this.#close());
    this.#sender.flush();
  }

  /** Number of operations that wait for the server. */
  get count() {
    return this.#known.filter(({ refusal }) => !refusal).length;
  }

  /**
   * Returns the operations of one inspection that the server has not accepted, oldest first.
   * @param {string} inspection
   */
  openFor(inspection) {
    return this.#known.filter((operation) => operation.inspection === inspection);
  }

  /**
   * Resolves when the operation is safe in this browser; it is sent in the background.
   * @param {Omit<Operation, 'id'>} operation
   */
  async add(operation) {
    const added = { id: idInTime(), ...operation };
    // What was refused of the same attachment is settled by this.
    const settled = this.#known.filter(({ attachment, refusal }) => refusal && attachment === operation.attachment);
    this.#known = [...this.#known.filter((other) => !settled.includes(other)), added];
    this.#changed();
    await this.#operations.put(added);
    for (const { id } of settled) await this.#operations.delete(id);
    this.#others.postMessage(null);
    this.#sender.flush();
  }

  /** Sends a refused operation again. @param {string} id */
  async sendAgain(id) {
    await this.#note(id, { refusal: null });
    this.#sender.flush();
  }

  /** Discards a refused operation. @param {string} id */
  async drop(id) {
    await this.#operations.delete(id);
    this.#known = this.#known.filter((operation) => operation.id !== id);
    this.#others.postMessage(null);
    this.#changed();
  }

  #close() {
    this.#sender.end();
    this.#others.close();
  }

  /** Sends the stored operations, not those that this tab last saw: another tab may have sent some. */
  async #sendAll() {
    /** @param {Operation} operation */
    const isReady = ({ refusal, observation }) => !refusal && !this.#tags.isWaiting(observation);
    let operation;
    while ((operation = (await this.#operations.all()).find(isReady))) {
      await this.#sendOne(operation);
      if (this.reason) return;
      this.#sender.arrived();
    }
    this.reason = null;
    await this.#read();
  }

  /** @param {Operation} operation */
  async #sendOne(operation) {
    let answer = null;
    try {
      answer = await deliver(operation, AbortSignal.timeout(ANSWER_LIMIT_S * 1000));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.isForLater) {
        this.reason = errorText(error);
        this.#changed();
        return;
      }
      if (operation.kind !== 'delete' || error.status !== 404) {
        this.reason = null;
        await this.#note(operation.id, { refusal: { code: error.code, message: error.message } });
        this.dispatchEvent(new CustomEvent('refused', { detail: { operation, error } }));
        return;
      }
    }
    this.reason = null;
    await this.#operations.delete(operation.id);
    this.#known = this.#known.filter(({ id }) => id !== operation.id);
    this.dispatchEvent(new CustomEvent('answered', { detail: { operation, answer } }));
    this.#others.postMessage(null);
    this.#changed();
  }

  /** @param {string} id @param {Partial<Operation>} changes */
  async #note(id, changes) {
    await this.#operations.update(id, changes);
    this.#known = this.#known.map((other) => (other.id === id ? { ...other, ...changes } : other));
    this.#others.postMessage(null);
    this.#changed();
  }

  /** Another tab has added or sent something. */
  async #readAgain() {
    await this.#read();
    this.dispatchEvent(new Event('elsewhere'));
  }

  async #read() {
    let seen;
    let all;
    do {
      seen = this.#known;
      all = await this.#operations.all();
    } while (seen !== this.#known); // something was added meanwhile
    this.#known = all;
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}

/**
 * Sends an operation; returns the stored attachment, null after a delete.
 * @param {Operation} operation
 * @param {AbortSignal} signal
 * @returns {Promise<Api['AttachmentOut']|null>}
 */
async function deliver({ inspection, observation, attachment, kind, body, sound, shown }, signal) {
  const path = `/api/inspections/${inspection}/observations/${observation}/attachments/${attachment}`;
  if (kind === 'delete') return remove(path, signal);
  if (kind === 'restore') return post(`${path}/restore`, undefined, signal);
  if (kind === 'put') return put(path, body, signal);
  const headers = { 'Content-Type': sound.type };
  const query = new URLSearchParams({ duration_s: String(shown.duration_s) });
  return bodyOf(await send('PUT', `${path}/voice?${query}`, { headers, body: sound, signal }), 'json');
}
