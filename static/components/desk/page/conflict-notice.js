/**
 * Changes that somebody else has overtaken: the page asks about each when it is found, one at a time.
 * Postponed ones are counted here, with a button that leads back to them.
 */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { askWhichHolds } from '../dialogs/conflict-dialog.js';

export class ConflictNotice extends Component {
  /** Ids of conflicts about which this page has asked. */
  #asked = new Set();
  #isAsking = false;

  mount() {
    const { conflicts, observations } = this.#desk;
    this.classList.add('message', 'message--warning');
    this.setAttribute('role', 'status');
    /** @type {Parts<'page/conflict-notice'>} */
    this.parts = render(
      this,
      html`${icon('alert')}<span data-part="text"></span>
        <button type="button" class="button button--small" data-part="compare">${icon('swap')}${t('conflict.compare')}</button>`,
    );
    this.listen(conflicts, 'change', () => this.#show());
    this.listen(conflicts, 'open', ({ detail }) => {
      this.#asked.delete(detail.id);
      this.#askAll();
    });
    this.listen(observations, 'change', () => this.#askAll());
    this.listen(this.parts.compare, 'click', () => {
      this.#asked.clear();
      this.#askAll();
    });
    this.#show();
  }

  get #desk() {
    return this.closest('inspection-page').desk;
  }

  #show() {
    const { length } = this.#desk.conflicts.value;
    this.hidden = length === 0;
    this.parts.text.textContent = length ? t('conflict.open', { n: length }) : '';
    this.#askAll();
  }

  async #askAll() {
    if (this.#isAsking) return;
    this.#isAsking = true;
    for (let next = this.#next; next && !this.signal.aborted; next = this.#next) {
      this.#asked.add(next.id);
      await this.#ask(next);
    }
    this.#isAsking = false;
  }

  /** A decision about an observation changes the list of them, so it waits until that is read. */
  get #next() {
    const { conflicts, observations } = this.#desk;
    const isReady = ({ kind }) => kind !== 'observation' || observations.isRead;
    return conflicts.value.find((one) => !this.#asked.has(one.id) && isReady(one));
  }

  async #ask(conflict) {
    const { conflicts } = this.#desk;
    const end = new AbortController();
    const isOpen = () => conflicts.value.includes(conflict);
    this.listen(conflicts, 'change', () => isOpen() || end.abort(), { signal: end.signal });
    this.signal.addEventListener('abort', () => end.abort(), { signal: end.signal });
    const choice = await askWhichHolds(this.#desk, conflict, end.signal);
    end.abort();
    if (choice === 'mine') await orToast(() => conflict.keepMine());
    if (choice === 'theirs') await orToast(() => conflict.takeTheirs());
  }
}

customElements.define('conflict-notice', ConflictNotice);
