/**
 * Brings the distance to scale: zero, known and taped lengths, joints, tolerances of the rig. Everything is
 * a draft with its result visible until it is applied; then every defect and export follows.
 */

import { knownLength } from '../../../core/survey/corrections.js';
import { refusalText } from '../../../core/survey/evidence.js';
import { html, render } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import './counter-section.js';
import './joints-section.js';
import './known-length.js';
import './outcome.js';
import './rig-doubt.js';
import './taped-lengths.js';
import './typed-section.js';
import './wall-ruler.js';
import './zero-section.js';

export class CorrectionsPanel extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.corrections = this.page.desk.corrections;
    /** @type {Parts<'corrections/corrections-panel'>} */
    this.parts = render(
      this,
      html`<div class="fix__body scrolls grow holds">
          <correction-outcome class="fix stack gap-3 packed one-column pad-4 line-above"></correction-outcome>
          <fieldset class="locked" ${!mayEdit() && 'disabled'}><div class="fix__columns one-column">
            <wall-ruler class="fix stack gap-3 packed one-column pad-4 line-above" hidden></wall-ruler>
            <zero-section class="fix stack gap-3 packed one-column pad-4 line-above"></zero-section>
            <counter-section class="fix stack gap-3 packed one-column pad-4 line-above"></counter-section>
            <known-length class="fix stack gap-3 packed one-column pad-4 line-above"></known-length>
            <taped-lengths class="fix stack gap-3 packed one-column pad-4 line-above"></taped-lengths>
            <typed-section class="fix stack gap-3 packed one-column pad-4 line-above"></typed-section>
            <joints-section class="fix stack gap-3 packed one-column pad-4 line-above"></joints-section>
            <rig-doubt class="fix stack gap-3 packed one-column pad-4 line-above"></rig-doubt>
          </div></fieldset>
        </div>
        <form class="fix__bar stack pad-head" data-part="bar" hidden novalidate>
          <div data-part="fault" role="alert"></div>
          <div class="field" data-part="forceBox" hidden><label for="fix-force">${t('corrections.force')}</label>
            <input class="input" id="fix-force" maxlength="4000" autocomplete="off" placeholder="${t('corrections.force_hint')}"
              data-part="force" /></div>
          <div class="fix__apply flow">
            <label class="visually-hidden" for="fix-remark">${t('corrections.remark')}</label>
            <input class="input" id="fix-remark" maxlength="4000" autocomplete="off" placeholder="${t('corrections.remark')}"
              data-part="remark" />
            <button type="button" class="button" data-part="discard">${t('corrections.discard')}</button>
            <button class="button button--primary" data-part="apply">${t('corrections.apply')}</button>
          </div>
        </form>`,
    );
    const { parts, corrections } = this;
    parts.remark.value = corrections.waiting?.remark ?? '';
    this.listen(parts.discard, 'click', () => {
      parts.remark.value = parts.force.value = '';
      corrections.discard();
    });
    this.listen(parts.force, 'input', () => {
      clearTimeout(this.forcing);
      this.forcing = setTimeout(() => corrections.edit({ forced: parts.force.value.trim() || null }), 300);
    });
    this.listen(parts.bar, 'submit', (event) => {
      event.preventDefault();
      this.#apply();
    });
    this.listen([corrections, corrections.draft, corrections.preview], 'change', () => this.#show());
    this.signal.addEventListener('abort', () => clearTimeout(this.forcing));
    this.#show();
  }

  async #apply() {
    const { parts, corrections } = this;
    const remark = parts.remark.value.trim() || null;
    parts.apply.disabled = true;
    await this.page.correct(corrections.draft.value, remark, { replaced: corrections.draftOf });
    if (!corrections.isEdited) parts.remark.value = parts.force.value = '';
    this.#show();
  }

  #show() {
    const { parts, corrections } = this;
    const { preview, isEdited, draft } = corrections;
    const error = preview.value?.error ?? null;
    parts.bar.hidden = !isEdited && !error;
    // A refused known length comes with its closure, so that a person can judge it.
    const isRefused = Boolean(error && preview.value.result && knownLength(draft.value));
    parts.forceBox.hidden = !isRefused && !draft.value.forced;
    if (parts.force !== document.activeElement) parts.force.value = draft.value.forced ?? '';
    // Not while the answer is awaited: a press on it may be what ended the typing. The server judges that, too.
    parts.apply.disabled = !isEdited || error !== null;
    if (preview.value === null) return; // the earlier fault stays until the new answer arrives
    const why = () => refusalText(preview.value.reason) ?? errorText(error);
    const text = isRefused ? t('corrections.refused') : error ? why() : '';
    if (parts.fault.textContent.trim() === text) return;
    render(
      parts.fault,
      error ? html`<p class="message message--error">${icon('alert')}<span>${text}</span></p>` : html``,
    );
  }
}

customElements.define('corrections-panel', CorrectionsPanel);
