/**
 * Changes of observations on their way to the server. Each is written to IndexedDB before it is
 * sent and removed when the server has answered, so a reload, a crash or a restart of the server
 * loses none. They are sent in order, one at a time, and every one may be sent twice.
 */

import { ApiError, post, put, remove } from './api.js';

const DATABASE = 'chainage-outbox';
const OPERATIONS = 'operations';
const PAUSES_S = [0.5, 1, 2, 5, 10];

/**
 * @typedef {object} Operation
 * @property {string} id sorts by time of creation
 * @property {string} inspection
 * @property {string} observation
 * @property {'save'|'delete'|'restore'} kind
 * @property {object} [fields] of a save
 */

const SEND = {
  save: (path, fields) => put(path, fields),
  delete: (path) => remove(path),
  restore: (path) => post(`${path}/restore`),
};

/**
 * Events: `change` (count or reason), `answered` (detail {operation, answer}),
 * `refused` (detail {operation, error}).
 */
export class Outbox extends EventTarget {
  /** What stops the first operation from being saved, or null. */
  reason = null;

  #database;
  #waiting;
  #sending = null;
  #written = Promise.resolve();
  #failures = 0;
  #timer = 0;

  /** Opens the box of this browser and goes on with what it still holds. */
  static async open() {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () =>
      request.result.createObjectStore(OPERATIONS, { keyPath: 'id' });
    const database = await settled(request);
    const waiting = await settled(objects(database).getAll());
    return new Outbox(database, waiting);
  }

  constructor(database, waiting) {
    super();
    this.#database = database;
    this.#waiting = waiting;
    addEventListener('online', () => this.#flush());
    this.#flush();
  }

  get count() {
    return this.#waiting.length;
  }

  /** Operations not yet answered of one inspection, oldest first. */
  waitingFor(inspection) {
    return this.#waiting.filter((operation) => operation.inspection === inspection);
  }

  isWaiting(observation) {
    return this.#waiting.some((operation) => operation.observation === observation);
  }

  /** Resolves when the operation is safe in this browser; sending goes on in the background. */
  async add(operation) {
    const last = this.#waiting.findLast((other) => other.observation === operation.observation);
    const replaces =
      last && last !== this.#sending && last.kind === 'save' && operation.kind === 'save';
    if (replaces) last.fields = operation.fields;
    else this.#waiting.push({ id: nextId(), ...operation });
    const stored = replaces ? last : this.#waiting.at(-1);
    this.#written = settled(objects(this.#database).put(stored));
    this.#changed();
    this.#flush();
    await this.#written;
  }

  async #flush() {
    clearTimeout(this.#timer);
    while (!this.#sending && this.#waiting.length) {
      const operation = this.#waiting[0];
      this.#sending = operation;
      try {
        await Promise.allSettled([this.#written]); // a failure to write is the caller's to show
        await this.#sendOne(operation);
      } finally {
        this.#sending = null;
      }
      if (this.reason) {
        const seconds = PAUSES_S[Math.min(this.#failures, PAUSES_S.length - 1)];
        this.#failures += 1;
        this.#timer = setTimeout(() => this.#flush(), seconds * 1000);
        return;
      }
      this.#failures = 0;
    }
  }

  async #sendOne(operation) {
    const path = `/api/inspections/${operation.inspection}/observations/${operation.observation}`;
    let event;
    try {
      const answer = await SEND[operation.kind](path, operation.fields);
      event = new CustomEvent('answered', { detail: { operation, answer } });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.isTemporary || error.status === 401) {
        this.reason = error.message;
        this.#changed();
        return;
      }
      const isGone = operation.kind === 'delete' && error.status === 404;
      event = isGone
        ? new CustomEvent('answered', { detail: { operation, answer: null } })
        : new CustomEvent('refused', { detail: { operation, error } });
    }
    await settled(objects(this.#database).delete(operation.id));
    this.#waiting.shift();
    this.reason = null;
    this.dispatchEvent(event);
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}

let made = 0;

function nextId() {
  made += 1;
  return `${Date.now()}-${String(made).padStart(8, '0')}-${Math.random()}`;
}

const objects = (database) => database.transaction(OPERATIONS, 'readwrite').objectStore(OPERATIONS);

/** Result of an IndexedDB request; a change counts only when its transaction is complete. */
function settled(request) {
  return new Promise((resolve, reject) => {
    request.onerror = () => reject(request.error);
    const { transaction } = request;
    if (!transaction || transaction.mode === 'readonly') request.onsuccess = () => resolve(request.result);
    else transaction.oncomplete = () => resolve(request.result);
  });
}
