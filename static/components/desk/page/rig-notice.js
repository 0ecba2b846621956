/**
 * Why the distances are of no use, or else how picture and rig disagree: the most serious one, with its repair as a
 * button.
 */

import { refusalIn } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { causeText, repairOf } from '../../../core/survey/diagnosis.js';
import { mayEdit } from '../../../core/page/rights.js';
import { t, wordFor } from '../../../core/page/words.js';
import { Component } from '../../../core/page/store.js';
import { icon } from '../../shared/icon/icon.js';

export class RigNotice extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    const { corrections, diagnosis, inspection } = this.page.desk;
    this.classList.add('message', 'message--warning');
    this.setAttribute('role', 'status');
    this.tabIndex = 0; // shown in full with the focus, or under the pointer
    /** @type {Parts<'page/rig-notice'>} */
    this.parts = render(
      this,
      html`${icon('alert')}<span data-part="text"></span>
        <button type="button" class="button button--small" data-needs="operator" data-part="repair" hidden></button>`,
    );
    this.listen(this.parts.repair, 'click', () => this.page.trackAgain(this.dataset.repair));
    this.listen([corrections, diagnosis], 'change', () => this.#show());
    this.listen(inspection, 'change', () => this.#load());
    this.#load();
    this.#show();
  }

  async #load() {
    try {
      await this.page.desk.diagnosis.load(this.signal);
    } catch (error) {
      if (!refusalIn(error)) return; // without it the page is as it was
    }
  }

  #show() {
    const { corrections, diagnosis } = this.page.desk;
    const cause = diagnosis.value?.causes[0];
    const [notice] = corrections.value?.result?.notices ?? [];
    this.hidden = !cause && !notice;
    if (this.hidden) return;
    const text = cause ? `${seen(diagnosis.value)}${causeText(cause)}` : wordFor('notice', notice.code, notice.params);
    setText(this.parts.text, text);
    const repair = cause ? cause.repair : repairOf(notice);
    const { repair: button } = this.parts;
    button.hidden = !repair || repair === 'film' || !mayEdit();
    if (button.hidden) return;
    this.dataset.repair = repair;
    setText(button, wordFor('repair_button', repair));
  }
}

/** 'Lost in 68 % of the film. ' @param {Api['DiagnosisOut']} diagnosis */
function seen({ lost_share: lost }) {
  const percent = Math.round(100 * (lost ?? 0));
  return percent ? `${t('cause.lost_in', { percent })} ` : '';
}

customElements.define('rig-notice', RigNotice);
