/** Shows the age of the live picture on screen, with a clock that also runs when no picture comes. */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const TICK_MS = 200;
const LATE_MS = 500;
/** After this long without a new picture, a message replaces the age. */
const STALLED_MS = 1000;

export class PictureAge extends Component {
  #drawnMs = 0;
  #capturedMs = null;

  mount() {
    const { desk } = this.closest('inspection-page');
    /** @type {Parts<'video/picture-age'>} */
    this.parts = render(this, html`${icon('alert')}<span class="number" data-part="text"></span>`);
    this.listen(desk.playhead, 'change', () => {
      this.#capturedMs = desk.playhead.value.capturedMs;
      this.#drawnMs = performance.now();
    });
    const timer = setInterval(() => this.#show(), TICK_MS);
    this.signal.addEventListener('abort', () => clearInterval(timer));
    this.#show();
  }

  #show() {
    this.hidden = this.#capturedMs === null;
    if (this.hidden) return;
    const now = performance.now();
    const [ageMs, silentMs] = [now - this.#capturedMs, now - this.#drawnMs];
    const isStalled = silentMs > STALLED_MS;
    const text = isStalled
      ? t('live.stalled', { s: (silentMs / 1000).toFixed(1) })
      : t('live.age', { s: (Math.max(ageMs, 0) / 1000).toFixed(2) });
    if (this.parts.text.textContent !== text) this.parts.text.textContent = text;
    this.classList.toggle('stage__age--late', isStalled || ageMs > LATE_MS);
  }
}

customElements.define('picture-age', PictureAge);
