/** Questions to the server that follow somebody's typing. */

/**
 * Returns a function that asks; while an answer is awaited, only the newest question waits.
 * @template Q
 * @param {(question: Q) => Promise<void>} ask
 * @returns {(question: Q) => Promise<void>}
 */
export function newest(ask) {
  let isAsking = false;
  /** @type {[Q]|null} */
  let waiting = null;
  return async (question) => {
    waiting = [question];
    if (isAsking) return;
    isAsking = true;
    try {
      while (waiting) {
        const [next] = waiting;
        waiting = null;
        await ask(next);
      }
    } finally {
      isAsking = false;
    }
  };
}
