/**
 * Changes of observations on their way to the server. Each is written to IndexedDB before it is
 * sent and removed when the server has answered, so a reload, a crash or a restart of the server
 * loses none. They are sent in order, one at a time, by one tab at a time, and every one may be sent
 * twice. What the server refuses stays here until the person has changed or undone it.
 */

import { ApiError, put, remove } from './api.js';
import { Operations } from './operations.js';
import { errorText } from './words.js';

const NAME = 'chainage-outbox';
const PAUSES_S = [0.5, 1, 2, 5, 10];
/** Time after which a silent server counts as unreachable; a photo takes a few seconds. */
const ANSWER_LIMIT_S = 30;
/** Pause in typing after which text is sent; it is stored at every letter. */
const TYPED_S = 0.8;

/**
 * @typedef {object} Operation
 * @property {string} id sorts by time of creation
 * @property {string} inspection
 * @property {string} observation
 * @property {'save'|'delete'} kind
 * @property {object} [fields] of a save
 * @property {{code: string, message: string}} [refusal] why the server refused it
 */

const SEND = {
  save: (path, fields, signal) => put(path, fields, signal),
  delete: (path, fields, signal) => remove(path, signal),
};

/**
 * Events: `change` (count, reason, or whether it is kept), `answered` (detail {operation, answer}),
 * `refused` (detail {operation, error}), `elsewhere` (another tab changed or sent something).
 */
export class Outbox extends EventTarget {
  /** What prevents the first operation from being sent, or null. */
  reason = null;

  #operations;
  /** All stored operations, oldest first. */
  #known;
  /** Id of the operation that is being sent. */
  #sending = null;
  #isFlushing = false;
  /** Whether something was added while the last was being sent. */
  #isAsked = false;
  #written = Promise.resolve();
  #failures = 0;
  #timer = 0;
  #typedTimer = 0;
  #others = new BroadcastChannel(NAME);

  /** Opens the outbox of this browser and sends what it still holds. */
  static async open() {
    const operations = await Operations.open();
    return new Outbox(operations, await operations.all());
  }

  constructor(operations, known) {
    super();
    this.#operations = operations;
    this.#known = known;
    this.#others.onmessage = () => this.#readAgain();
    addEventListener('online', () => this.#flush());
    addEventListener('beforeunload', (event) => {
      if (!this.isKept && this.count) event.preventDefault();
    });
    this.#flush();
  }

  /** Number of operations that wait for the server. */
  get count() {
    return this.#waiting.length;
  }

  /** Whether everything here survives the page; without storage in the browser it does not. */
  get isKept() {
    return this.#operations.isKept;
  }

  /** Returns the operations of one inspection that the server has not accepted, oldest first. */
  openFor(inspection) {
    return this.#known.filter((operation) => operation.inspection === inspection);
  }

  isWaiting(observation) {
    return this.#waiting.some((operation) => operation.observation === observation);
  }

  /** Resolves when no operation of an inspection is waiting, or when `signal` aborts. */
  async whenSent(inspection, signal) {
    const waits = () => this.#waiting.some((operation) => operation.inspection === inspection);
    while (waits() && !signal.aborted) {
      await new Promise((resolve) => {
        this.addEventListener('change', resolve, { once: true, signal });
        signal.addEventListener('abort', resolve, { once: true });
      });
    }
  }

  /** Resolves when the operation is safe in this browser; it is sent in the background. */
  async add(operation) {
    await this.#keep(operation);
    this.#flush();
  }

  /** Like `add`, for text that is still being typed: it is sent after a pause in typing. */
  async addTyped(operation) {
    clearTimeout(this.#typedTimer);
    this.#typedTimer = setTimeout(() => this.#flush(), 1000 * TYPED_S);
    await this.#keep(operation);
  }

  async #keep(operation) {
    const { observation } = operation;
    const last = this.#known.findLast((other) => other.observation === observation);
    const isOvertaken =
      last && last.id !== this.#sending && last.kind === 'save' && operation.kind === 'save';
    // A refused operation is settled by its successor. Another tab may be sending the replaced one just
    // now, so the successor has its own id.
    const replaced = isOvertaken || last?.refusal ? last : null;
    const added = { id: nextId(), ...operation };
    this.#known = [...this.#known.filter((other) => other !== replaced), added];
    this.#written = this.#operations.put(added, replaced?.id);
    this.#changed();
    await this.#written;
    this.#changed();
    this.#others.postMessage(null);
  }

  /** Discards what the server refused of an observation. */
  async drop(observation) {
    const refused = this.#known.filter((other) => other.observation === observation && other.refusal);
    this.#known = this.#known.filter((other) => !refused.includes(other));
    for (const { id } of refused) await this.#operations.delete(id);
    this.#others.postMessage(null);
    this.#changed();
  }

  get #waiting() {
    return this.#known.filter(({ refusal }) => !refusal);
  }

  async #flush() {
    this.#isAsked = true;
    if (this.#isFlushing) return;
    this.#isFlushing = true;
    clearTimeout(this.#timer);
    try {
      while (this.#isAsked) {
        this.#isAsked = false;
        await alone(() => this.#sendAll());
      }
    } finally {
      this.#isFlushing = false;
    }
    if (!this.reason) return;
    const seconds = PAUSES_S[Math.min(this.#failures, PAUSES_S.length - 1)];
    this.#failures += 1;
    this.#timer = setTimeout(() => this.#flush(), seconds * 1000);
  }

  /** Sends what the box holds, not what this tab last saw: another tab may have sent it. */
  async #sendAll() {
    for (;;) {
      await this.#written;
      const operation = (await this.#operations.all()).find(({ refusal }) => !refusal);
      if (!operation) break;
      this.#sending = operation.id;
      try {
        await this.#sendOne(operation);
      } finally {
        this.#sending = null;
      }
      if (this.reason) return;
      this.#failures = 0;
    }
    this.reason = null;
    await this.#read();
  }

  async #sendOne(operation) {
    const path = `/api/inspections/${operation.inspection}/observations/${operation.observation}`;
    let event;
    try {
      const limit = AbortSignal.timeout(ANSWER_LIMIT_S * 1000);
      const answer = await SEND[operation.kind](path, operation.fields, limit);
      event = new CustomEvent('answered', { detail: { operation, answer } });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      // Another person's token may permit what this one does not.
      if (error.isTemporary || error.status === 401 || error.code === 'forbidden') {
        this.reason = errorText(error);
        this.#changed();
        return;
      }
      const isGone = operation.kind === 'delete' && error.status === 404;
      event = isGone
        ? new CustomEvent('answered', { detail: { operation, answer: null } })
        : new CustomEvent('refused', { detail: { operation, error } });
    }
    await this.#settle(operation, event);
  }

  /** Takes an operation out of the box, or marks it as refused, and notifies. */
  async #settle(operation, event) {
    if (event.type === 'refused') {
      const { code, message } = event.detail.error;
      const refused = { ...operation, refusal: { code, message } };
      await this.#operations.put(refused);
      this.#known = this.#known.map((other) => (other.id === refused.id ? refused : other));
    } else {
      await this.#operations.delete(operation.id);
      this.#known = this.#known.filter(({ id }) => id !== operation.id);
    }
    this.reason = null;
    this.dispatchEvent(event);
    this.#changed();
    this.#others.postMessage(null);
  }

  async #readAgain() {
    await this.#read();
    this.dispatchEvent(new Event('elsewhere'));
    if (this.count) this.#flush();
  }

  /** Reads what other tabs have added or removed. */
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

/** Runs `send` while no other tab does. Over plain http, where locks are missing, at once. */
const alone = (send) => (navigator.locks ? navigator.locks.request(NAME, send) : send());

let made = 0;

function nextId() {
  made += 1;
  return `${Date.now()}-${String(made).padStart(8, '0')}-${Math.random()}`;
}
