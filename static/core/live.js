/**
 * The only WebSocket of the page: poses and pictures of one inspection, newest first.
 *
 * A message is a 4-byte big-endian header length, the header as JSON, then the JPEG (may be empty).
 * The server sends the next one only after an acknowledgement, so a slow page sees fewer pictures
 * and never old ones.
 *
 * States: CLOSED => CONNECTING => OPEN => CLOSED; ENDED when the server refuses for good.
 */

const REFUSED = { 4401: 'signed-out', 4404: 'gone' };
const LONGEST_PAUSE_S = 8;

/**
 * Splits one binary message.
 * @param {ArrayBuffer} message
 * @returns {{header: object, jpeg: Uint8Array|null}}
 */
export function parseMessage(message) {
  const length = new DataView(message).getUint32(0);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length)));
  const jpeg = new Uint8Array(message, 4 + length);
  return { header, jpeg: jpeg.length ? jpeg : null };
}

/**
 * Events: `message` (detail {header, jpeg}; call `acknowledge(header.seq)` when it is on screen),
 * `state` (property `state`).
 */
export class LiveFeed extends EventTarget {
  #socket = null;
  #timer = 0;
  #failures = 0;
  #url;

  state = 'CLOSED';

  /**
   * @param {string} path
   * @param {AbortSignal} signal ends the feed
   */
  constructor(path, signal) {
    super();
    this.#url = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
    signal.addEventListener('abort', () => this.#end('ENDED'));
    // A hidden page asks for nothing; a page that is seen again starts at once.
    document.addEventListener(
      'visibilitychange',
      () => (document.hidden ? this.#close() : this.#connect()),
      { signal },
    );
    this.#connect();
  }

  acknowledge(seq) {
    this.send({ type: 'ack', seq });
  }

  /** Sends a command; answers false when there is no connection. */
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
      this.#failures = 0;
      this.#become('OPEN');
    };
    socket.onmessage = ({ data }) => {
      if (typeof data !== 'string') {
        this.dispatchEvent(new CustomEvent('message', { detail: parseMessage(data) }));
      }
    };
    socket.onclose = ({ code }) => {
      if (socket !== this.#socket) return;
      this.#socket = null;
      if (REFUSED[code]) this.#end(REFUSED[code]);
      else this.#retry();
    };
    this.#socket = socket;
  }

  #retry() {
    if (this.state === 'ENDED') return;
    this.#become('CLOSED');
    this.#failures += 1;
    const longest = Math.min(LONGEST_PAUSE_S, 0.25 * 2 ** this.#failures);
    this.#timer = setTimeout(() => this.#connect(), longest * (0.5 + Math.random() / 2) * 1000);
  }

  #close() {
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    if (this.state !== 'ENDED') this.#become('CLOSED');
  }

  #end(reason) {
    this.#close();
    this.reason = reason;
    this.#become('ENDED');
  }

  #become(state) {
    if (this.state === state) return;
    this.state = state;
    this.dispatchEvent(new Event('state'));
  }
}
