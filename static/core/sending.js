/** What all outboxes share: when to send again, and that only one tab sends. */

const PAUSES_S = [0.5, 1, 2, 5, 10];

/** Returns the pause after so many failures, in seconds. */
export const pauseS = (failures) => PAUSES_S[Math.min(failures, PAUSES_S.length - 1)];

/**
 * Resolves when no operation of an inspection is waiting, or when `signal` aborts.
 * @param {EventTarget} box fires `change`; `openFor` returns its operations, with `refusal` where they do not wait
 */
export async function whenSent(box, inspection, signal) {
  const waits = () => box.openFor(inspection).some(({ refusal }) => !refusal);
  while (waits() && !signal.aborted) {
    await new Promise((resolve) => {
      box.addEventListener('change', resolve, { once: true, signal });
      signal.addEventListener('abort', resolve, { once: true });
    });
  }
}

/** Runs `send` while no other tab does. Over plain http, where locks are missing, at once. */
export const alone = (name, send) => (navigator.locks ? navigator.locks.request(name, send) : send());
