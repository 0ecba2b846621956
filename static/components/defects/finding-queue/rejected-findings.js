/** The rejected findings, folded, each with a way back into the queue. */

import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { placeText, titleOf } from './words.js';

export class RejectedFindings extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'finding-queue/rejected-findings'>} */
    this.parts = render(
      this,
      html`<details class="more pad-3" data-part="more" hidden><summary data-part="title"></summary>
        <ol class="pad-1" data-part="rows"></ol></details>`,
    );
    const { parts, desk } = this;
    this.listen(parts.more, 'toggle', () => this.#show());
    this.listen([desk.findings, desk.inspection], 'change', () => this.#show());
    this.listen(parts.rows, 'click', ({ target }) => {
      const button = target.closest('[data-reopen]');
      if (button) desk.findings.reopen(button.dataset.reopen);
    });
    this.#show();
  }

  /** Lists them only while somebody looks: there may be thousands. */
  #show() {
    const { parts, desk } = this;
    const rejected = desk.findings.in('rejected');
    parts.more.hidden = rejected.length === 0;
    setText(parts.title, t('findings.rejected', { n: rejected.length }));
    if (!parts.more.open) return;
    renderNew(
      parts.rows,
      html`${rejected.map(
        (
          finding,
        ) => html`<li class="rejected row wrap apart"><span class="shrinks"><b>${titleOf(finding)}</b> <span class="number dim">${placeText(finding)}
          ${finding.decided_by && t('findings.by', { who: finding.decided_by })}</span></span>
          <button type="button" class="button button--small" data-reopen="${finding.id}" ${!mayEdit() && 'disabled'}
            aria-label="${t('findings.reopen_named', { name: titleOf(finding), where: placeText(finding) })}">${icon('undo')}${t('findings.reopen')}</button></li>`,
      )}`,
    );
  }
}

customElements.define('rejected-findings', RejectedFindings);
