/** How far the search of the wall is, in words; starts and cancels it. */

import { get, refusalIn } from '../../../core/server/api.js';
import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const BUILT_IN = 'classical';

export class FindingSearch extends Component {
  /** The models of users. */
  #models = [];

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.classList.add('row', 'wrap', 'pad-row', 'small');
    /** @type {Parts<'finding-queue/finding-search'>} */
    this.parts = render(
      this,
      html`<p class="grow shrinks dim" role="status" data-part="state"></p>
        <select class="input queue__filter" data-part="detector" aria-label="${t('findings.detector')}" data-needs="operator" hidden></select>
        <button type="button" class="button button--small" data-part="search" data-needs="operator">${icon('search')}${t('findings.search')}</button>
        <button type="button" class="button button--small" data-part="cancel" data-needs="operator" hidden>${icon('stop')}${t('desk.cancel')}</button>`,
    );
    const { parts, desk } = this;
    const { findings } = desk;
    this.listen(parts.search, 'click', () => orToast(() => findings.search(parts.detector.value || BUILT_IN)));
    this.listen(parts.cancel, 'click', () => orToast(() => findings.cancel()));
    this.listen([findings, desk.inspection], 'change', () => this.#show());
    this.#show();
    this.#load();
  }

  async #load() {
    try {
      this.#models = (await get('/api/detectors', this.signal)).detectors;
    } catch (error) {
      refusalIn(error); // the built-in one is there in any case
      return;
    }
    this.#show();
  }

  #show() {
    const { parts, desk } = this;
    const { findings } = desk;
    if (!findings.value) return;
    const { search } = findings.value;
    setText(parts.state, this.#textOf(search));
    parts.state.classList.toggle('fault', search.state === 'failed');
    parts.search.hidden = findings.isSearching;
    parts.search.disabled = desk.inspection.isUnfinished || !mayEdit();
    parts.cancel.hidden = !findings.isSearching;
    parts.detector.hidden = this.#models.length === 0 || findings.isSearching;
    renderNew(
      parts.detector,
      html`<option value="${BUILT_IN}">${t('findings.built_in')}</option>${this.#models.map(({ id, name }) => html`<option value="${id}">${name}</option>`)}`,
    );
  }

  #textOf({ state, detail, detector, searched_to_m: to }) {
    const name = this.#models.find(({ id }) => id === detector)?.name ?? t('findings.built_in');
    const where = chainage(to ?? 0);
    if (state === 'waiting') return t('findings.waiting');
    if (state === 'searching') return to === null ? t('findings.begins') : t('findings.searching', { to: where, name });
    if (state === 'failed') return t('findings.failed', { reason: detail ?? '' });
    if (state === 'done') return t('findings.searched', { to: where, name });
    return this.desk.inspection.isUnfinished ? t('findings.later') : t('findings.not_searched');
  }
}

customElements.define('finding-search', FindingSearch);
