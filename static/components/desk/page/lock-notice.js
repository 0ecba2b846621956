/**
 * Begins the page anew when somebody approves or reopens the inspection, as what can be changed depends on that. While a
 * remark is being typed it waits and says so; while a dialog is open it waits for its end.
 */

import { html, render } from '../../../core/page/html.js';
import { isLocked } from '../../../core/defects/review.js';
import { lock } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** What the end of a dialog has begun is sent by then. */
const AFTER_DIALOG_MS = 500;

export class LockNotice extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { inspection, drafts } = this.desk;
    this.wasLocked = isLocked(inspection.value);
    this.listen([inspection, drafts], 'change', () => this.#look());
    // `close` does not bubble.
    this.listen(document, 'close', () => setTimeout(() => this.#look(), AFTER_DIALOG_MS), { capture: true });
  }

  #look() {
    const { inspection, drafts } = this.desk;
    const isNow = isLocked(inspection.value);
    if (isNow === this.wasLocked || document.querySelector('dialog[open]')) return;
    if (!isNow || drafts.isEmpty) {
      location.reload();
      return;
    }
    if (!this.hidden) return;
    lock(true);
    this.hidden = false;
    const { begin } = render(
      this,
      html`<p class="message message--warning" role="alert">${icon('lock')}<span>${t('reviewing.locked_meanwhile', { who: inspection.value.review.by })}</span>
        <button type="button" class="button button--small" data-part="begin">${t('reviewing.show_locked')}</button></p>`,
    );
    begin.addEventListener('click', () => location.reload());
  }
}

customElements.define('lock-notice', LockNotice);
