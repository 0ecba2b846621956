/** What all outboxes share: one tab sends, one operation at a time, and again after a pause where that failed. */

const PAUSES_S = [0.5, 1, 2, 5, 10];

/** Sends what an outbox holds. */
export class Sender {
  #name;
  #sendAll;
  #isStuck;
  #isFlushing = false;
  /** Whether something was added while the last was being sent. */
  #isAsked = false;
  #failures = 0;
  #timer = 0;

  /**
   * @param {string} name of the outbox in this browser
   * @param {() => Promise<void>} sendAll sends until nothing is left, or until `isStuck`
   * @param {() => boolean} isStuck whether the last could not be sent
   */
  constructor(name, sendAll, isStuck) {
    this.#name = name;
    this.#sendAll = sendAll;
    this.#isStuck = isStuck;
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
        await alone(this.#name, this.#sendAll);
      }
    } finally {
      this.#isFlushing = false;
    }
    if (!this.#isStuck()) return;
    const seconds = PAUSES_S[Math.min(this.#failures, PAUSES_S.length - 1)];
    this.#failures += 1;
    this.#timer = setTimeout(() => this.flush(), seconds * 1000);
  }

  /** Notes that something has arrived: the next pause is a short one. */
  arrived() {
    this.#failures = 0;
  }

  /** Sends nothing more by itself. */
  end() {
    clearTimeout(this.#timer);
  }
}

/**
 * Resolves when no operation of an inspection is waiting, or when `signal` aborts.
 * @param {import('./outbox.js').Outbox|import('./attachment-outbox.js').AttachmentOutbox} box
 * @param {string} inspection
 * @param {AbortSignal} signal
 */
export async function whenSent(box, inspection, signal) {
  const waits = () => box.openFor(inspection).some((/** @type {{refusal?: unknown}} */ { refusal }) => !refusal);
  while (waits() && !signal.aborted) {
    await new Promise((resolve) => {
      box.addEventListener('change', resolve, { once: true, signal });
      signal.addEventListener('abort', resolve, { once: true });
    });
  }
}

/**
 * Runs `send` while no other tab does. Over plain http, where locks are missing, at once.
 * @param {string} name
 * @param {() => Promise<void>} send
 */
const alone = (name, send) => (navigator.locks ? navigator.locks.request(name, send) : send());
