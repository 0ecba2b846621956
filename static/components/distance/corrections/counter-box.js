/**
 * A picture of the film on which a person draws a box around the counter, or moves the one that was found.
 * Fires `box` when it has changed; `value` is the box.
 */

import { html, render } from '../../../core/page/html.js';
import { squareOf } from '../../../core/wall/pixels.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const LONG_STEP_PX = 10;
/** The server refuses smaller boxes. */
const LEAST_PX = 8;

export class CounterBox extends Component {
  #size = [1, 1];
  /** @type {import('../../../core/survey/counter.js').Box|null} */
  #box = null;
  #from = null;

  get value() {
    return this.#box;
  }

  set value(box) {
    this.#box = box;
    if (this.parts) this.#show();
  }

  /**
   * @param {{source: string, alt: string, width: number, height: number, pixel_aspect: number}} picture
   * @param {import('../../../core/survey/counter.js').Box|null} box
   */
  draw({ source, alt, ...film }, box) {
    const { width, height } = film;
    const shown = squareOf(film);
    this.#size = [width, height];
    this.#box = box;
    /** @type {Parts<'corrections/counter-box'>} */
    this.parts = render(
      this,
      html`<div class="counter-box__picture holds" data-part="frame">
          <img class="full" src="${source}" width="${shown.width}" height="${shown.height}" alt="${alt}" draggable="false" />
          <svg class="counter-box__drawing full" preserveAspectRatio="none" viewBox="0 0 ${width} ${height}" data-part="drawing" tabindex="0"
            role="application" aria-label="${t('counter.box')}" aria-describedby="counter-box-help">
            <rect class="counter-box__edge" data-part="edge" />
          </svg>
        </div>
        <p class="visually-hidden" role="status" data-part="said"></p>
        <p class="help" id="counter-box-help">${t('counter.box_help')}</p>`,
    );
    const { drawing, frame } = this.parts;
    frame.style.setProperty('--aspect', shown.width / shown.height);
    this.listen(drawing, 'pointerdown', (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      drawing.setPointerCapture(event.pointerId);
      drawing.focus({ preventScroll: true }); // the box begins where the pointer is
      this.#from = this.#pixelAt(event);
    });
    this.listen(drawing, 'pointermove', (event) => {
      if (this.#from && drawing.hasPointerCapture(event.pointerId)) this.#drag(this.#pixelAt(event));
    });
    for (const end of ['pointerup', 'pointercancel']) this.listen(drawing, end, () => (this.#from = null));
    this.listen(drawing, 'keydown', (event) => this.#key(event));
    this.#show();
  }

  /** @returns {[number, number]} */
  #pixelAt({ clientX, clientY }) {
    const frame = this.parts.drawing.getBoundingClientRect();
    const [width, height] = this.#size;
    return [
      within(Math.round(((clientX - frame.left) / frame.width) * width), width),
      within(Math.round(((clientY - frame.top) / frame.height) * height), height),
    ];
  }

  #drag([x, y]) {
    const [u, v] = this.#from;
    const box = [Math.min(u, x), Math.min(v, y), Math.max(u, x), Math.max(v, y)];
    if (box[2] - box[0] >= LEAST_PX && box[3] - box[1] >= LEAST_PX) this.#change(box);
  }

  /** Arrows move the box, with Ctrl they move its right and lower edge; without a box they begin one. */
  #key(event) {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    const [width, height] = this.#size;
    if (!this.#box) {
      this.#change([width / 4, (3 * height) / 4, width / 2, height - LEAST_PX].map(Math.round));
      return;
    }
    const px = event.shiftKey ? LONG_STEP_PX : 1;
    const [left, top, right, bottom] = this.#box;
    const [across, down] = step.map((at) => at * px);
    if (event.ctrlKey) {
      this.#change([
        left,
        top,
        Math.max(within(right + across, width), left + LEAST_PX),
        Math.max(within(bottom + down, height), top + LEAST_PX),
      ]);
      return;
    }
    const [x, y] = [
      within(left + across, width - (right - left)) - left,
      within(top + down, height - (bottom - top)) - top,
    ];
    this.#change([left + x, top + y, right + x, bottom + y]);
  }

  #change(box) {
    this.#box = box;
    this.#show();
    this.dispatchEvent(new Event('box'));
  }

  #show() {
    const { edge, said } = this.parts;
    edge.classList.toggle('counter-box__edge--none', this.#box === null);
    if (!this.#box) return;
    const [left, top, right, bottom] = this.#box;
    const shown = { x: left, y: top, width: right - left, height: bottom - top };
    for (const [name, value] of Object.entries(shown)) edge.setAttribute(name, value);
    said.textContent = t('counter.box_at', shown);
  }
}

const within = (value, most) => Math.min(Math.max(value, 0), most);

customElements.define('counter-box', CounterBox);
