/** Reads again what others have changed: when the server says so, when the line is back, when the page is seen again. */

import { ApiError, keptSince } from './api.js';

/** Changes within this time are read together; a page's own change has its answer by then. */
const PAUSE_MS = 300;
/** Time after which a reading that the server could not answer is tried again. */
const AGAIN_MS = 3000;

/**
 * @param {import('./live.js').LiveFeed} live
 * @param {() => Promise<void>} read called once at a time
 * @param {(error: ApiError) => void} onError
 * @param {AbortSignal} signal
 */
export function followChanges(live, read, onError, signal) {
  let timer = 0;
  let isReading = false;
  let isDue = false;
  let wasOpen = keptSince !== undefined; // then what was read first may be old

  const soon = () => {
    isDue = true;
    if (!timer && !isReading) readIn(PAUSE_MS);
  };
  /** @param {number} ms */
  const readIn = (ms) => {
    timer = setTimeout(readAll, ms);
  };

  async function readAll() {
    timer = 0;
    isReading = true;
    isDue = false;
    let pauseMs = PAUSE_MS;
    try {
      await read();
    } catch (error) {
      if (error.name !== 'AbortError' && !(error instanceof ApiError)) throw error;
      if (error instanceof ApiError && !error.isTemporary) onError(error);
      // Without a line the next reading comes with it; a server that is only too busy says nothing when it is not.
      if (error.isTemporary && live.state === 'OPEN') {
        isDue = true;
        pauseMs = AGAIN_MS;
      }
    } finally {
      isReading = false;
    }
    if (isDue && !signal.aborted) readIn(pauseMs);
  }

  live.addEventListener('changed', soon, { signal });
  live.addEventListener(
    'state',
    () => {
      if (live.state !== 'OPEN') return;
      if (wasOpen) soon(); // what happened meanwhile was not announced
      wasOpen = true;
    },
    { signal },
  );
  document.addEventListener('visibilitychange', () => document.hidden || soon(), { signal });
  signal.addEventListener('abort', () => clearTimeout(timer));
}
