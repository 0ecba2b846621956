/**
 * What the modules of the page ask of a browser, for Node: a document without elements, storage in memory, and
 * requests that go to the server of the tests. Import it before any module of the page.
 */

import { setMaxListeners } from 'node:events';

const { CHAINAGE_URL: server, CHAINAGE_TOKEN: token } = process.env;

class MemoryStorage {
  getItem(key) {
    return Object.hasOwn(this, key) ? this[key] : null;
  }

  setItem(key, value) {
    this[key] = String(value);
  }

  removeItem(key) {
    delete this[key];
  }
}

const window = new EventTarget();
setMaxListeners(0, window);

Object.assign(globalThis, {
  document: Object.assign(new EventTarget(), {
    documentElement: { dataset: { role: 'operator', person: 'tester' }, toggleAttribute() {} },
    hidden: false,
    querySelector: () => null,
    querySelectorAll: () => [],
  }),
  HTMLElement: class {},
  customElements: { define() {} },
  localStorage: new MemoryStorage(),
  sessionStorage: new MemoryStorage(),
  location: { origin: server, pathname: '/', search: '' },
  history: {
    replaceState(_state, _title, url) {
      location.search = new URL(url, server).search;
    },
  },
  addEventListener: window.addEventListener.bind(window),
  dispatchEvent: window.dispatchEvent.bind(window),
  /** A line on which nothing is ever heard. */
  WebSocket: class extends EventTarget {
    send() {}

    close() {}
  },
});

const fetchFrom = globalThis.fetch;

/** The line to the server. A test may put something between: `meet(path, pass, method)` passes a request on, or not. */
export const line = {
  meet: null,
  /** Asks the server past the page, as somebody else; returns JSON, or null where the answer is empty. */
  async ask(method, path, content) {
    const body = content === undefined ? undefined : JSON.stringify(content);
    const answer = await passed(path, { method, body, headers: { 'Content-Type': 'application/json' } });
    if (!answer.ok) throw new Error(`${method} ${path}: ${answer.status} ${await answer.text()}`);
    const text = await answer.text();
    return text ? JSON.parse(text) : null;
  },
  cut() {
    this.meet = () => Promise.reject(new TypeError('The line is cut.'));
  },
  mend() {
    this.meet = null;
    dispatchEvent(new Event('online'));
  },
};

const passed = (path, { headers, ...options } = {}) =>
  fetchFrom(new URL(path, server), { ...options, headers: { ...headers, Authorization: `Bearer ${token}` } });

globalThis.fetch = (path, options = {}) => {
  const pass = () => passed(path, options);
  if (!line.meet) return pass();
  const given = Promise.withResolvers();
  options.signal?.addEventListener('abort', () => given.reject(options.signal.reason));
  line.meet(path, pass, options.method ?? 'GET').then(given.resolve, given.reject);
  return given.promise;
};
