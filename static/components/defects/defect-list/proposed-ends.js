/** The start and the end of the survey as proposals, each to be confirmed; Finish confirms both. */

import { html, renderNew } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { confirmEnd, proposedEnds } from '../../desk/actions/ends.js';

export class ProposedEnds extends Component {
  #ends = [];

  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { checks, inspection, observations } = this.desk;
    this.listen([checks, inspection, observations], 'change', () => this.#show());
    // A click leaves the keyboard focus with the film.
    this.listen(this, 'mousedown', (event) => event.preventDefault());
    this.listen(this, 'click', ({ target }) => {
      const { look, confirm } = target.closest('button')?.dataset ?? {};
      if (look !== undefined) this.desk.seek(this.#ends[look].frame);
      if (confirm !== undefined) confirmEnd(this.desk, this.#ends[confirm]);
    });
    this.#show();
  }

  #show() {
    this.#ends = mayEdit() ? proposedEnds(this.desk) : [];
    this.hidden = this.#ends.length === 0;
    renderNew(this, html`<ul aria-label="${t('ends.label')}">${this.#ends.map((end, at) => this.#row(end, at))}</ul>`);
  }

  #row({ code, char1, distance_m: at }, i) {
    const name = [code, char1].filter(Boolean).join(' ');
    return html`<li class="proposed-end row">
      <button class="row bare grow shrinks" data-look="${i}" title="${t('ends.look')}"><small class="strong dim">${t('ends.proposed')}</small>
        <b class="nowrap">${name}</b><span class="one-line grow shrinks dim">${this.desk.catalogue.label(code, char1)}</span>
        <span class="number nowrap">${chainage(at)}</span></button>
      <button class="button button--small" data-confirm="${i}" aria-label="${t('ends.confirm_named', { name })}">${t('ends.confirm')}</button></li>`;
  }
}

customElements.define('proposed-ends', ProposedEnds);
