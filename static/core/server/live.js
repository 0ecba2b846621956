/**
 * The only WebSocket of the page: poses and pictures of one inspection, newest first.
 *
 * A binary message is a 4-byte big-endian header length, the header as JSON, then the JPEG (may be
 * empty). The server sends the next one only after an acknowledgement, so a slow page sees fewer
 * pictures and never old ones. A text message is JSON with a `type`.
 *
 * The page sends a ping every two seconds: the answer shows the delay of messages, which is part of a
 * picture's age, and a missing answer reveals a dead connection.
 *
 * States: CLOSED => CONNECTING => OPEN => CLOSED; ENDED when the server refuses for good.
 */

/** @type {Record<number, string>} */
const REFUSED = { 4401: 'signed-out', 4404: 'gone' };
const LONGEST_PAUSE_S = 8;
const PING_EVERY_MS = 2000;
/** Silence after which the connection is given up. */
const DEAD_AFTER_MS = 10_000;

/**
 * Splits one binary message.
 * @param {ArrayBuffer} message
 * @returns {{header: {seq: number, age_ms: number|null}, jpeg: Uint8Array|null}}
 */
export function parseMessage(message) {
  const length = new DataView(message).getUint32(0);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
  const jpeg = new Uint8Array(message, 4 + length);
  return { header, jpeg: jpeg.length ? jpeg : null };
}

/**
 * Returns when the camera delivered the picture of a message, by `performance.now`; null for a file.
 * @param {number|null} ageMs as the server stated it when it sent the message
 * @param {number} roundTripMs
 * @param {number} receivedMs
 */
export const capturedAt = (ageMs, roundTripMs, receivedMs) =>
  ageMs === null ? null : receivedMs - roundTripMs / 2 - ageMs;

/**
 * Events: `message` (detail {header, jpeg, capturedMs}; call `acknowledge(header.seq)` when it is on
 * screen), `state` (property `state`), and one named by the `type` of each text message (detail: the
 * message).
 */
export class LiveFeed extends EventTarget {
  /** @type {WebSocket|null} */
  #socket = null;
  #timer = 0;
  #pings = 0;
  #answeredMs = 0;
  #failures = 0;
  #url;

  /** @type {'CLOSED'|'CONNECTING'|'OPEN'|'ENDED'} */
  state = 'CLOSED';
  /** `seq` of the newest message. */
  seq = 0;
  /** Round trip of the last ping; 0 before the first answer. */
  roundTripMs = 0;

  /**
   * @param {string} path
   * @param {AbortSignal} signal ends the feed
   */
  constructor(path, signal) {
    super();
    this.#url = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
    signal.addEventListener('abort', () => this.#end('ENDED'));
    // A hidden page requests nothing; it resumes at once when it becomes visible.
    document.addEventListener('visibilitychange', () => (document.hidden ? this.#close() : this.#connect()), {
      signal,
    });
    addEventListener('online', () => this.#connect(), { signal });
    this.addEventListener('pong', ({ detail }) => this.#answered(detail.t));
    this.#connect();
  }

  /** @param {number} seq */
  acknowledge(seq) {
    this.send({ type: 'ack', seq });
  }

  /** Sends a command; returns false when there is no connection. @param {object} command */
  send(command) {
    if (this.state !== 'OPEN') return false;
    this.#socket.send(JSON.stringify(command));
    return true;
  }

  #connect() {
    if (this.state !== 'CLOSED' || document.hidden) return;
    clearTimeout(this.#timer);
    this.#become('CONNECTING');
    const socket = new WebSocket(this.#url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      if (socket === this.#socket) this.#opened();
    };
    socket.onmessage = ({ data }) => {
      if (socket === this.#socket) this.#receive(data);
    };
    socket.onclose = ({ code }) => {
      if (socket !== this.#socket) return;
      this.#leave();
      if (REFUSED[code]) this.#end(REFUSED[code]);
      else this.#retry();
    };
    this.#socket = socket;
  }

  #opened() {
    this.#failures = 0;
    this.#become('OPEN');
    this.#answeredMs = performance.now();
    this.#ping();
    this.#pings = setInterval(() => this.#ping(), PING_EVERY_MS);
  }

  #ping() {
    const now = performance.now();
    if (now - this.#answeredMs < DEAD_AFTER_MS) this.send({ type: 'ping', t: now });
    else {
      this.#leave();
      this.#retry();
    }
  }

  /** @param {number} sentMs */
  #answered(sentMs) {
    this.#answeredMs = performance.now();
    this.roundTripMs = this.#answeredMs - sentMs;
  }

  /** @param {string|ArrayBuffer} data */
  #receive(data) {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type) this.dispatchEvent(new CustomEvent(message.type, { detail: message }));
      return;
    }
    const { header, jpeg } = parseMessage(data);
    this.seq = header.seq;
    const capturedMs = capturedAt(header.age_ms, this.roundTripMs, performance.now());
    this.dispatchEvent(new CustomEvent('message', { detail: { header, jpeg, capturedMs } }));
  }

  #retry() {
    if (this.state === 'ENDED') return;
    this.#become('CLOSED');
    this.#failures += 1;
    const longest = Math.min(LONGEST_PAUSE_S, 0.25 * 2 ** this.#failures);
    this.#timer = setTimeout(() => this.#connect(), longest * (0.5 + Math.random() / 2) * 1000);
  }

  /** Drops the connection without waiting for the other side. */
  #leave() {
    clearInterval(this.#pings);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  #close() {
    clearTimeout(this.#timer);
    this.#leave();
    if (this.state !== 'ENDED') this.#become('CLOSED');
  }

  /** @param {string} reason */
  #end(reason) {
    this.#close();
    this.reason = reason;
    this.#become('ENDED');
  }

  /** @param {LiveFeed['state']} state */
  #become(state) {
    if (this.state === state) return;
    this.state = state;
    this.dispatchEvent(new Event('state'));
  }
}
