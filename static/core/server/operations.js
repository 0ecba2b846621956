/**
 * Stores operations until the server has them: in IndexedDB, which all tabs of the browser share. Where the
 * browser gives no storage, they are in the memory of the page, and `isKept` is false.
 */

const OPERATIONS = 'operations';

/**
 * @template {{id: string}} Kept
 */
export class Operations {
  #database;
  /** @type {Map<string, Kept>} */
  #inMemory = new Map();
  /** Changes by id that did not fit into the browser's storage. @type {Map<string, Partial<Kept>>} */
  #unwritten = new Map();

  /** Whether everything stored here survives the page. */
  get isKept() {
    return this.#database !== null && this.#inMemory.size === 0;
  }

  /** @param {string} name of the database in the browser */
  static async open(name) {
    if (!globalThis.indexedDB) return new Operations(null);
    try {
      const request = indexedDB.open(name, 1);
      request.onupgradeneeded = () => request.result.createObjectStore(OPERATIONS, { keyPath: 'id' });
      return new Operations(await settled(request));
    } catch (error) {
      if (!(error instanceof DOMException)) throw error; // blocked by the browser, or damaged
      return new Operations(null);
    }
  }

  /** @param {IDBDatabase|null} database */
  constructor(database) {
    this.#database = database;
  }

  /** Returns all operations, oldest first. @returns {Promise<Kept[]>} */
  async all() {
    const kept = this.#database ? await settled(this.#objects().getAll()) : [];
    const known = kept.map((operation) => ({ ...operation, ...this.#unwritten.get(operation.id) }));
    return [...known, ...this.#inMemory.values()].sort((a, b) => (a.id < b.id ? -1 : 1));
  }

  /**
   * Stores an operation; resolves when it is as safe as this browser allows.
   * @param {Kept} operation
   * @param {string|null} [replaced] id of the operation that it replaces
   */
  async put(operation, replaced = null) {
    try {
      if (!this.#database) throw new DOMException('', 'NotFoundError');
      const objects = this.#objects();
      if (replaced) objects.delete(replaced);
      await settled(objects.put(operation));
    } catch (error) {
      if (!(error instanceof DOMException)) throw error; // no storage, or none allowed
      this.#inMemory.set(operation.id, operation); // before any pause: the next change may replace it at once
      if (replaced) await this.delete(replaced);
    }
  }

  /**
   * Changes an operation in place, unless another tab has removed it meanwhile.
   * @returns {Promise<boolean>} whether it was still there
   * @param {string} id
   * @param {Partial<Kept>} changes
   */
  async update(id, changes) {
    const kept = this.#inMemory.get(id);
    if (kept) this.#inMemory.set(id, { ...kept, ...changes });
    if (kept || !this.#database) return Boolean(kept);
    const objects = this.#objects();
    const found = objects.get(id);
    found.onsuccess = () => found.result && objects.put({ ...found.result, ...changes });
    try {
      await ended(objects.transaction);
    } catch (error) {
      if (!(error instanceof DOMException)) throw error; // no room
      this.#unwritten.set(id, { ...this.#unwritten.get(id), ...changes });
    }
    return found.result !== undefined;
  }

  /** @param {string} id */
  async delete(id) {
    this.#inMemory.delete(id);
    this.#unwritten.delete(id);
    if (this.#database) await settled(this.#objects().delete(id));
  }

  #objects() {
    return this.#database.transaction(OPERATIONS, 'readwrite').objectStore(OPERATIONS);
  }
}

/**
 * Awaits an IndexedDB request; a change counts only when its transaction is complete.
 * @template T
 * @param {IDBRequest<T>} request
 * @returns {Promise<T>}
 */
async function settled(request) {
  if (!request.transaction) await opened(request);
  else {
    request.transaction.commit(); // at once: a tab that is closed now loses nothing
    await ended(request.transaction);
  }
  return request.result;
}

/** @param {IDBRequest} request */
const opened = (request) =>
  new Promise((resolve, reject) => {
    request.onsuccess = resolve;
    request.onerror = () => reject(request.error);
  });

/** @param {IDBTransaction} transaction */
const ended = (transaction) =>
  new Promise((resolve, reject) => {
    transaction.oncomplete = resolve;
    transaction.onabort = () => reject(transaction.error);
  });
