/** The only `fetch` of the page: JSON in and out, one kind of error. */

/** A refused or failed request. `status` is 0 when the server could not be reached. */
export class ApiError extends Error {
  /** For an overtaken change: the stored content, null if it was deleted. */
  current = /** @type {any} */ (null);
  /** The version of that content. */
  version = /** @type {string|null} */ (null);

  /**
   * @param {number} status
   * @param {string} code
   * @param {string} detail
   */
  constructor(status, code, detail) {
    super(detail);
    this.status = status;
    this.code = code;
  }

  /** Whether the same request may succeed later without anyone changing it. */
  get isTemporary() {
    const { status } = this;
    return status === 0 || status === 423 || status === 429 || status >= 500;
  }

  /** Whether what was sent waits in its outbox: it may be accepted later, or from another person. */
  get isForLater() {
    return this.isTemporary || this.status === 401 || this.code === 'forbidden';
  }

  /** Whether the stored version is no longer the one that the change was based on. */
  get isOvertaken() {
    return this.code === 'changed_meanwhile';
  }
}

/**
 * Returns the refusal of a request, null where nobody waits for the answer any more; throws every other error again.
 * @param {any} error
 * @returns {ApiError|null}
 */
export function refusalIn(error) {
  if (error instanceof ApiError) return error;
  if (error.name === 'AbortError') return null;
  throw error;
}

/**
 * Awaits what reads from the server; calls `later` if that may succeed later.
 * @param {Promise<unknown>} reading
 * @param {() => void} later
 */
export async function readOr(reading, later) {
  try {
    await reading;
  } catch (error) {
    if (refusalIn(error)?.isTemporary) later();
    else if (error.name !== 'AbortError') throw error;
  }
}

/**
 * When the server sent this page, if it was opened from what this browser has kept (`service-worker.js`): then
 * what the page reads may be kept too.
 * @type {string|undefined}
 */
export const keptSince = document.documentElement.dataset.kept;

/** Fires `signed-out` when the server no longer accepts this browser's session, and `answered` whenever it answers. */
export const session = new EventTarget();

/**
 * Sends a request; returns the response, or throws an ApiError when it is not a success.
 * @param {string} method
 * @param {string} path
 * @param {{headers?: Record<string, string>, body?: BodyInit, signal?: AbortSignal, allow?: number[]}} [options]
 *     allow: failing statuses that the caller handles
 */
export async function send(method, path, { headers = {}, body, signal, allow = [] } = {}) {
  const all = keptSince === undefined ? headers : { ...headers, 'Chainage-Kept': 'yes' };
  const response = await reached(fetch(path, { method, headers: all, body, signal, credentials: 'same-origin' }));
  session.dispatchEvent(new Event('answered'));
  if (response.ok || allow.includes(response.status)) return response;
  if (response.status === 401) session.dispatchEvent(new Event('signed-out'));
  throw await refusal(response);
}

/**
 * Reads the body of a response; `as`: 'json', 'text', 'blob' or 'arrayBuffer'.
 * @param {Response} response
 * @param {'json'|'text'|'blob'|'arrayBuffer'} as
 * @returns {Promise<any>}
 */
export const bodyOf = (response, as) => reached(response[as]());

/**
 * Awaits the beginning or the body of an answer; an ApiError when the line is dead, or breaks on the way.
 * @template T
 * @param {Promise<T>} answer
 */
async function reached(answer) {
  try {
    return await answer;
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    throw new ApiError(0, 'unreachable', 'The server cannot be reached.');
  }
}

/** @param {Response} response */
async function refusal(response) {
  const text = await bodyOf(response, 'text');
  try {
    const { code, detail, current = null } = JSON.parse(text);
    const version = response.headers.get('ETag')?.replaceAll('"', '') ?? null;
    return Object.assign(new ApiError(response.status, code, detail), { current, version });
  } catch {
    return new ApiError(response.status, 'unknown', `The server answered ${response.status}.`);
  }
}

/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} content
 * @param {AbortSignal} [signal]
 * @param {string|null} [replaced]
 * @returns {Promise<any>}
 */
async function json(method, path, content, signal, replaced = null) {
  const body = content === undefined ? undefined : JSON.stringify(content);
  const headers = {
    ...(body !== undefined && { 'Content-Type': 'application/json' }),
    ...(replaced !== null && { 'If-Match': `"${replaced}"` }),
  };
  const response = await send(method, path, { headers, body, signal });
  return response.status === 204 ? null : bodyOf(response, 'json');
}

/** @param {string} path @param {AbortSignal} [signal] */
export const get = (path, signal) => json('GET', path, undefined, signal);
/**
 * @param {string} path
 * @param {unknown} [content]
 * @param {AbortSignal} [signal]
 */
export const post = (path, content, signal) => json('POST', path, content, signal);
/**
 * `replaced`: version that the change was based on; without it any version is replaced or removed.
 * @param {string} path
 * @param {unknown} content
 * @param {AbortSignal} [signal]
 * @param {string|null} [replaced]
 */
export const put = (path, content, signal, replaced) => json('PUT', path, content, signal, replaced);
/**
 * @param {string} path
 * @param {unknown} content
 * @param {AbortSignal} [signal]
 * @param {string|null} [replaced]
 */
export const patch = (path, content, signal, replaced) => json('PATCH', path, content, signal, replaced);
/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @param {string|null} [replaced]
 */
export const remove = (path, signal, replaced) => json('DELETE', path, undefined, signal, replaced);
/**
 * Removes what `content` names.
 * @param {string} path
 * @param {unknown} content
 * @param {AbortSignal} [signal]
 */
export const removeSome = (path, content, signal) => json('DELETE', path, content, signal);
/**
 * Sends a file unchanged; the answer is JSON.
 * @param {string} path
 * @param {Blob} file
 * @param {AbortSignal} [signal]
 */
export const sendFile = async (path, file, signal) => {
  const headers = { 'Content-Type': 'application/octet-stream' };
  return bodyOf(await send('POST', path, { headers, body: file, signal }), 'json');
};
/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<Blob>}
 */
export const blob = async (path, signal) => bodyOf(await send('GET', path, { signal }), 'blob');

/**
 * Takes a picture of a camera that is not recorded yet.
 * @param {Api['GlanceIn']} camera
 * @param {AbortSignal} [signal]
 * @returns {Promise<Blob>}
 */
export const takePicture = async (camera, signal) => {
  const headers = { 'Content-Type': 'application/json' };
  const body = JSON.stringify(camera);
  return bodyOf(await send('POST', '/api/sources/picture', { headers, body, signal }), 'blob');
};

/**
 * Calls `ask` repeatedly, after the pause in seconds that it returns, while the page is visible; `null`
 * ends it. A failed call is repeated after 3 s.
 * @param {() => Promise<number|null>} ask
 * @param {AbortSignal} signal
 * @param {(error: ApiError) => void} onError
 */
export async function poll(ask, signal, onError) {
  while (!signal.aborted) {
    let pauseS = 3;
    try {
      pauseS = await ask();
    } catch (error) {
      if (signal.aborted || error.name === 'AbortError') return;
      if (!(error instanceof ApiError)) throw error;
      onError(error);
      if (!error.isTemporary) return;
    }
    if (pauseS === null) return;
    await pause(pauseS, signal);
    if (document.hidden) await seen(signal);
  }
}

/** Ends after `seconds`, or at once when `signal` aborts. @param {number} seconds @param {AbortSignal} [signal] */
export function pause(seconds, signal) {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, seconds * 1000);
    signal?.addEventListener('abort', () => (clearTimeout(timer), resolve()), { once: true });
  });
}

/** @param {AbortSignal} signal */
function seen(signal) {
  return new Promise((resolve) => {
    signal.addEventListener('abort', resolve, { once: true });
    document.addEventListener('visibilitychange', resolve, { once: true, signal });
  });
}
