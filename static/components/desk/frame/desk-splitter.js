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

  mount() {
    const part = PARTS[this.dataset.of];
    this.setAttribute('role', 'separator');
    this.setAttribute('aria-orientation', part.isColumn ? 'vertical' : 'horizontal');
    this.setAttribute('aria-label', part.label);
    this.title = t('splitter.help');
    this.tabIndex = 0;
    this.#size(remembered()[this.dataset.of] ?? null);
    const along = ({ clientX, clientY }) => (part.isColumn ? clientX : clientY);
    this.listen(this, 'pointerdown', (event) => {
      event.preventDefault();
      this.focus({ preventScroll: true });
      this.setPointerCapture(event.pointerId);
      this.#taken = { at: along(event), size: this.#now };
    });
    this.listen(this, 'pointermove', (event) => {
      if (!this.hasPointerCapture(event.pointerId)) return;
      const moved = along(event) - this.#taken.at;
      this.#size(this.#taken.size + (part.growsOnward ? moved : -moved));
    });
    this.listen(this, 'lostpointercapture', () => this.#remember());
    this.listen(this, 'dblclick', () => this.#reset());
    this.listen(this, 'keydown', (event) => this.#press(event, part));
    this.listen(this, 'focus', () => this.#state());
  }

  get #desk() {
    return this.parentElement;
  }

  get #part() {
    return this.#desk.querySelector(`:scope > .desk__${this.dataset.of}`);
  }

  get #now() {
    const { width, height } = this.#part.getBoundingClientRect();
    return PARTS[this.dataset.of].isColumn ? width : height;
  }

  get #limit() {
    const { least, most, isColumn } = PARTS[this.dataset.of];
    const { clientWidth, clientHeight } = this.#desk;
    return Math.max(least, most * (isColumn ? clientWidth : clientHeight));
  }

  #press(event, { isColumn, growsOnward }) {
    const [back, onward] = isColumn ? ['ArrowLeft', 'ArrowRight'] : ['ArrowUp', 'ArrowDown'];
    const [less, more] = growsOnward ? [back, onward] : [onward, back];
    if (event.key === 'Home') this.#reset();
    else if (event.key === less) this.#size(this.#now - STEP_PX);
    else if (event.key === more) this.#size(this.#now + STEP_PX);
    else return;
    event.preventDefault();
    this.#remember();
  }

  #reset() {
    this.#size(null);
    this.#remember();
  }

  /** Gives the part a size in px, null for the usual one. */
  #size(px) {
    const { least } = PARTS[this.dataset.of];
    this.size = px === null ? null : Math.round(Math.min(Math.max(px, least), this.#limit));
    const property = `--desk-${this.dataset.of}`;
    if (this.size === null) this.#desk.style.removeProperty(property);
    else this.#desk.style.setProperty(property, `${this.size}px`);
    this.#state();
  }

  #state() {
    this.setAttribute('aria-valuemin', String(PARTS[this.dataset.of].least));
    this.setAttribute('aria-valuemax', String(Math.round(this.#limit)));
    this.setAttribute('aria-valuenow', String(Math.round(this.#now)));
  }

  #remember() {
    const { [this.dataset.of]: _, ...others } = remembered();
    const all = this.size === null ? others : { ...others, [this.dataset.of]: this.size };
    remember(REMEMBERED, all);
  }
}

customElements.define('desk-splitter', DeskSplitter);
