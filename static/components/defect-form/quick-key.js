/** Keeps what is stated about a defect as what a digit key tags: "Crack, along the pipe, 2 mm at 12". */

import { ApiError } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { preferences, quickCodesWith } from '../../core/preferences.js';
import { Component } from '../../core/store.js';
import { t } from '../../core/words.js';
import { quickCodes } from '../video-panel/quick-codes.js';
import { toast, toastError } from '../toast-stack/toast-stack.js';

class QuickKey extends Component {
  #item = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.parts = render(
      this,
      html`<select class="input" data-part="key" aria-label="${t('form.quick_key')}" title="${t('form.quick_key_help')}"></select>`,
    );
    this.listen(this.parts.key, 'change', () => this.#keep(Number(this.parts.key.value)));
    this.listen(preferences, 'change', () => this.#offer());
    this.#offer();
  }

  /** @param {object} item the observation of the form */
  show(item) {
    this.#item = item;
    this.hidden = !item.code;
  }

  #offer() {
    const { key } = this.parts;
    render(
      key,
      html`<option value="">${t('form.quick_key')}</option>
        ${quickCodes(this.desk.catalogue).map(({ label }, i) => html`<option value="${i}">${i + 1} – ${label}</option>`)}`,
    );
    key.value = '';
  }

  async #keep(i) {
    const before = preferences.value.quick_codes;
    await this.#save(quickCodesWith(i, this.#item));
    toast(t('form.quick_kept', { key: i + 1 }), { action: t('page.undo'), run: () => this.#save(before) });
  }

  async #save(quickOnes) {
    try {
      await preferences.save({ quick_codes: quickOnes });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      toastError(error);
    }
  }
}

customElements.define('quick-key', QuickKey);
