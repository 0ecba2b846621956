/**
 * Attachments on their way to the server: photos of frames, drawings, voice notes, and their deletion. They wait for
 * their observation.
 */

import { bodyOf, post, put, remove, send } from './api.js';
import { Operations } from './operations.js';
import { StoredOutbox } from './stored-outbox.js';

const NAME = 'chainage-attachments';
/** A voice note of 1 MB takes its time. */
const ANSWER_LIMIT_S = 60;

/**
 * @typedef {import('./stored-outbox.js').Queued & Attached} Operation
 *
 * @typedef {object} Attached
 * @property {string} attachment
 * @property {'put'|'voice'|'delete'|'restore'} kind
 * @property {import('../defects/attachments.js').Shown} [shown] the attachment as the page shows it meanwhile; none of a delete
 * @property {object} [body] of a put
 * @property {Blob} [sound] of a voice note
 */

/** @extends {StoredOutbox<Operation>} */
export class AttachmentOutbox extends StoredOutbox {
  /** The outbox of the observations. */
  #tags;

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
    super(NAME, operations, known, ANSWER_LIMIT_S, signal);
    this.#tags = tags;
    tags.addEventListener('change', () => this.count && this.flush(), { signal });
  }

  /**
   * Resolves when the operation is safe in this browser; it is sent in the background.
   * @param {Omit<Operation, 'id'>} operation
   */
  async add(operation) {
    // What was refused of the same attachment is settled by this.
    await this.put(
      operation,
      this.known.filter(({ attachment, refusal }) => refusal && attachment === operation.attachment),
    );
    this.flush();
  }

  /** Sends a refused operation again. @param {string} id */
  async sendAgain(id) {
    await this.change(id, { refusal: null });
    this.tellOthers();
    this.changed();
    this.flush();
  }

  /** Discards a refused operation. @param {string} id */
  drop(id) {
    return this.discard(this.known.filter((operation) => operation.id === id));
  }

  /** @param {Operation} operation */
  isReady(operation) {
    return super.isReady(operation) && !this.#tags.isWaiting(operation.observation);
  }

  /**
   * @param {Operation} operation
   * @param {AbortSignal} signal
   * @returns {Promise<Api['AttachmentOut']|null>}
   */
  async deliver({ inspection, observation, attachment, kind, body, sound, shown }, signal) {
    const path = `/api/inspections/${inspection}/observations/${observation}/attachments/${attachment}`;
    if (kind === 'delete') return remove(path, signal);
    if (kind === 'restore') return post(`${path}/restore`, undefined, signal);
    if (kind === 'put') return put(path, body, signal);
    const headers = { 'Content-Type': sound.type };
    const query = new URLSearchParams({ duration_s: String(shown.duration_s) });
    return bodyOf(await send('PUT', `${path}/voice?${query}`, { headers, body: sound, signal }), 'json');
  }
}
