/** What was said about one defect, at the end of its form: accept it, ask about it, comment on it. */

import { ApiError } from '../../../core/server/api.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { pressed, remarkRow, say } from './remarks.js';

/** A change that takes longer waits for the line: then there is nothing to remark on yet. */
const SENT_WITHIN_MS = 5000;

export class DefectReview extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { desk } = this;
    const { drafts } = desk;
    const id = this.closest('defect-form').observationId;
    /** @type {Parts<'panels/defect-review'>} */
    this.parts = render(
      this,
      html`<h3>${t('reviewing.of_defect')}</h3>
        <ul aria-label="${t('reviewing.of_defect')}" data-part="list"></ul>
        ${
          !mayEdit() &&
          drafts.of(id) &&
          html`<div class="field"><label for="remark-text">${t('reviewing.kept')}</label>
          <textarea class="input" id="remark-text" rows="2" readonly>${drafts.of(id)}</textarea></div>`
        }
        ${
          mayEdit() &&
          html`<div class="field"><label for="remark-text">${t('reviewing.say')}</label>
          <textarea class="input" id="remark-text" rows="2" maxlength="2000" aria-describedby="remark-fault" data-part="text">${drafts.of(id)}</textarea>
          <span class="fault" aria-live="polite" id="remark-fault" data-part="fault"></span></div>
        <div class="flow">
          <button type="button" class="button button--small" data-say="accepted">${icon('check')}${t('reviewing.accept')}</button>
          <button type="button" class="button button--small" data-say="question">${icon('help')}${t('reviewing.ask')}</button>
          <button type="button" class="button button--small" data-say="comment">${icon('edit')}${t('reviewing.comment')}</button>
        </div>`
        }`,
    );
    this.listen(this, 'click', (event) => {
      const { say: kind } = event.target.closest('[data-say]')?.dataset ?? {};
      orToast(() => (kind ? this.#say(kind) : pressed(desk, event)));
    });
    // The form around it saves the fields of the observation; a remark is none.
    for (const type of ['input', 'change']) this.listen(this, type, (event) => event.stopPropagation());
    if (this.parts.text) this.listen(this.parts.text, 'input', () => drafts.put(id, this.parts.text.value));
    this.listen([desk.review, desk.observations], 'change', () => this.#show());
    this.#show();
  }

  get #item() {
    return this.desk.observations.find(this.closest('defect-form').observationId);
  }

  async #say(kind) {
    const { parts, desk } = this;
    const text = parts.text.value.trim();
    const isMissing = kind !== 'accepted' && !text;
    parts.fault.textContent = isMissing ? t('reviewing.text_needed') : '';
    parts.text.setAttribute('aria-invalid', String(isMissing));
    if (isMissing) {
      parts.text.focus();
      return;
    }
    parts.text.value = ''; // at once: the next button belongs to the next remark
    const { id } = this.#item;
    try {
      await say(desk, await this.#saved(), kind, text);
      if (!parts.text.value) desk.drafts.put(id, '');
    } catch (error) {
      parts.text.value ||= text;
      if (!error.isOvertaken) throw error;
      await desk.readAgain(); // the person sees what is stored now, and decides again
      parts.fault.textContent = t('reviewing.changed_meanwhile');
    }
  }

  /** Returns the defect once its last change has arrived: a remark is about what is stored. */
  async #saved() {
    await this.desk.whenSent(AbortSignal.any([this.signal, AbortSignal.timeout(SENT_WITHIN_MS)]));
    const item = this.#item;
    if (!item?.version) throw new ApiError(0, 'not_sent', t('reviewing.not_sent'));
    return item;
  }

  #show() {
    const item = this.#item;
    const remarks = item ? this.desk.review.about(item.id) : [];
    const isOld = ({ kind, version }) => kind === 'accepted' && item.version !== null && version !== item.version;
    renderNew(this.parts.list, html`${remarks.map((remark) => remarkRow(remark, { isOld: isOld(remark) }))}`);
  }
}

customElements.define('defect-review', DefectReview);
