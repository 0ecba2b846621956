/** Values that announce their changes, and elements that listen only while they are in the page. */

/**
 * Holds one value and fires `change` when it is replaced.
 * @template T
 */
export class Store extends EventTarget {
  #value;

  /** @param {T} value */
  constructor(value) {
    super();
    this.#value = value;
  }

  get value() {
    return this.#value;
  }

  /** @param {T} value */
  set(value) {
    if (Object.is(value, this.#value)) return;
    this.#value = value;
    this.dispatchEvent(new Event('change'));
  }
}

/**
 * Listens on some targets until `signal` aborts.
 * @template {string} Name
 * @param {EventTarget|EventTarget[]} targets
 * @param {Name} type
 * @param {AbortSignal} signal
 * @param {(event: EventOf<Name>) => unknown} handler
 * @param {AddEventListenerOptions} [options]
 */
export function listenTo(targets, type, signal, handler, options = {}) {
  for (const target of [targets].flat()) {
    target.addEventListener(type, /** @type {EventListener} */ (handler), { ...options, signal });
  }
}

/** A custom element: `mount` runs when it enters the page, its listeners end when it leaves. */
export class Component extends HTMLElement {
  #lifetime = new AbortController();
  #frame = 0;

  connectedCallback() {
    this.#lifetime = new AbortController();
    this.mount();
  }

  disconnectedCallback() {
    this.#lifetime.abort();
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
  }

  /** Aborts when the element leaves the page. */
  get signal() {
    return this.#lifetime.signal;
  }

  /**
   * @template {string} Name
   * @param {EventTarget|EventTarget[]} targets
   * @param {Name} type
   * @param {(event: EventOf<Name>) => unknown} handler
   * @param {AddEventListenerOptions} [options]
   */
  listen(targets, type, handler, options = {}) {
    listenTo(targets, type, this.signal, handler, options);
  }

  /** Calls `paint` before the next frame, once for any number of calls. */
  repaint() {
    if (this.#frame) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.paint();
    });
  }

  mount() {}

  paint() {}
}
