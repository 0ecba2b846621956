/**
 * Stores operations until the server has them: in IndexedDB, which all tabs of the browser share. Where the
 * browser gives no storage, they are in the memory of the page, and `isKept` is false.
 */

const DATABASE = 'chainage-outbox';
const OPERATIONS = 'operations';

export class Operations {
  #database;
  #inMemory = new Map();

  /** Whether everything stored here survives the page. */
  get isKept() {
    return this.#database !== null && this.#inMemory.size === 0;
  }

  static async open() {
    if (!globalThis.indexedDB) return new Operations(null);
    try {
      const request = indexedDB.open(DATABASE, 1);
      request.onupgradeneeded = () =>
        request.result.createObjectStore(OPERATIONS, { keyPath: 'id' });
      return new Operations(await settled(request));
    } catch (error) {
      if (!(error instanceof DOMException)) throw error; // blocked by the browser, or damaged
      return new Operations(null);
    }
  }

  constructor(database) {
    this.#database = database;
  }

  /** Returns all operations, oldest first. */
  async all() {
    const kept = this.#database ? await settled(this.#objects().getAll()) : [];
    return [...kept, ...this.#inMemory.values()].sort((a, b) => (a.id < b.id ? -1 : 1));
  }

  /**
   * Stores an operation; resolves when it is as safe as this browser allows.
   * @param {{id: string}} operation
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
      if (replaced) await this.delete(replaced);
      this.#inMemory.set(operation.id, operation);
    }
  }

  async delete(id) {
    this.#inMemory.delete(id);
    if (this.#database) await settled(this.#objects().delete(id));
  }

  #objects() {
    return this.#database.transaction(OPERATIONS, 'readwrite').objectStore(OPERATIONS);
  }
}

/** Awaits an IndexedDB request; a change counts only when its transaction is complete. */
function settled(request) {
  return new Promise((resolve, reject) => {
    request.onerror = () => reject(request.error);
    const { transaction } = request;
    if (!transaction) {
      request.onsuccess = () => resolve(request.result);
      return;
    }
    transaction.oncomplete = () => resolve(request.result);
    transaction.onabort = () => reject(transaction.error);
    transaction.commit(); // at once: a tab that is closed now loses nothing
  });
}
