/** The edge between two parts of the desk, moved by hand or by key; this browser remembers where. */

import { recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

const REMEMBERED = 'chainage.desk';
const STEP_PX = 24;
/**
 * The part that each edge sizes: its words, its least size in px, its greatest share of the desk, and whether it
 * grows as the edge moves right or down.
 */
const PARTS = {
  side: { label: t('splitter.side'), least: 340, most: 0.6, isColumn: true, growsOnward: false },
  strip: { label: t('splitter.strip'), least: 90, most: 0.6, isColumn: false, growsOnward: false },
  viewer: { label: t('splitter.viewer'), least: 110, most: 0.7, isColumn: false, growsOnward: true },
};

/** @returns {Record<string, number>} sizes by part */
const remembered = () => recall(REMEMBERED, {});

/** `data-of` names the part; the desk's style sheet reads its size from a property of that name. */
export class DeskSplitter extends Component {
  /** Where the pointer took the edge, and the size of the part then, in px. */
  #taken = { at: 0, size: 0 };
  #part;

  mount() {
    this.#part = PARTS[this.dataset.of];
    const { isColumn, growsOnward, label } = this.#part;
    this.setAttribute('role', 'separator');
    this.setAttribute('aria-orientation', isColumn ? 'vertical' : 'horizontal');
    this.setAttribute('aria-label', label);
    this.title = t('splitter.help');
    this.tabIndex = 0;
    this.#setSize(remembered()[this.dataset.of] ?? null);
    const along = ({ clientX, clientY }) => (isColumn ? clientX : clientY);
    this.listen(this, 'pointerdown', (event) => {
      event.preventDefault();
      this.focus({ preventScroll: true });
      this.setPointerCapture(event.pointerId);
      this.#taken = { at: along(event), size: this.#now };
    });
    this.listen(this, 'pointermove', (event) => {
      if (!this.hasPointerCapture(event.pointerId)) return;
      const moved = along(event) - this.#taken.at;
      this.#setSize(this.#taken.size + (growsOnward ? moved : -moved));
    });
    this.listen(this, 'lostpointercapture', () => this.#remember());
    this.listen(this, 'dblclick', () => this.#reset());
    this.listen(this, 'keydown', (event) => this.#press(event));
    this.listen(this, 'focus', () => this.#describe());
  }

  get #now() {
    const { width, height } = this.parentElement
      .querySelector(`:scope > .desk__${this.dataset.of}`)
      .getBoundingClientRect();
    return this.#part.isColumn ? width : height;
  }

  get #limit() {
    const { least, most, isColumn } = this.#part;
    const { clientWidth, clientHeight } = this.parentElement;
    return Math.max(least, most * (isColumn ? clientWidth : clientHeight));
  }

  #press(event) {
    const { isColumn, growsOnward } = this.#part;
    const [back, onward] = isColumn ? ['ArrowLeft', 'ArrowRight'] : ['ArrowUp', 'ArrowDown'];
    const step = growsOnward ? STEP_PX : -STEP_PX;
    if (event.key === 'Home') this.#reset();
    else if (event.key === back) this.#setSize(this.#now - step);
    else if (event.key === onward) this.#setSize(this.#now + step);
    else return;
    event.preventDefault();
    this.#remember();
  }

  #reset() {
    this.#setSize(null);
    this.#remember();
  }

  /** Gives the part a size in px, null for the usual one. */
  #setSize(px) {
    this.size = px === null ? null : Math.round(Math.min(Math.max(px, this.#part.least), this.#limit));
    const property = `--desk-${this.dataset.of}`;
    if (this.size === null) this.parentElement.style.removeProperty(property);
    else this.parentElement.style.setProperty(property, `${this.size}px`);
    this.#describe();
  }

  #describe() {
    const values = { min: this.#part.least, max: this.#limit, now: this.#now };
    for (const [name, px] of Object.entries(values)) this.setAttribute(`aria-value${name}`, String(Math.round(px)));
  }

  #remember() {
    const { [this.dataset.of]: _, ...others } = remembered();
    remember(REMEMBERED, this.size === null ? others : { ...others, [this.dataset.of]: this.size });
  }
}

customElements.define('desk-splitter', DeskSplitter);
