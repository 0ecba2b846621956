/** Keeps what is stated about a defect for a digit key or as a template: "Crack, along the pipe, 2 mm at 12". */

import { ApiError } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { preferences, quickCodesWith, templateOf } from '../../../core/page/preferences.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { TEMPLATE_KEYS } from '../code-chain/templates.js';
import { quickCodes } from '../../film/video/quick-codes.js';
import { toast, toastError } from '../../shared/toast-stack/toast-stack.js';

/** The choice that is no digit key. */
const TEMPLATE = 'template';

export class QuickKey extends Component {
  #item = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'defect-form/quick-key'>} */
    this.parts = render(
      this,
      html`<select class="input" data-part="key" aria-label="${t('form.quick_key')}" title="${t('form.quick_key_help')}"></select>`,
    );
    this.listen(this.parts.key, 'change', () => this.#keep(this.parts.key.value));
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
        ${quickCodes(this.desk.catalogue).map(({ label }, i) => html`<option value="${i}">${i + 1} – ${label}</option>`)}
        <option value="${TEMPLATE}" ${preferences.value.templates.length === TEMPLATE_KEYS.length && 'disabled'}>${t('form.template')}</option>`,
    );
    key.value = '';
  }

  async #keep(where) {
    const { quick_codes: quickOnes, templates } = preferences.value;
    const isTemplate = where === TEMPLATE;
    const isKept = await this.#save(
      isTemplate
        ? { templates: [...templates, templateOf(this.#item)] }
        : { quick_codes: quickCodesWith(Number(where), this.#item) },
    );
    if (!isKept) return;
    const text = isTemplate
      ? t('form.template_kept', { key: TEMPLATE_KEYS[templates.length] })
      : t('form.quick_kept', { key: Number(where) + 1 });
    const before = isTemplate ? { templates } : { quick_codes: quickOnes };
    toast(text, { action: t('page.undo'), run: () => this.#save(before) });
  }

  /** Returns whether the server has taken the changes; why not is shown. */
  async #save(changes) {
    try {
      await preferences.save(changes);
      return true;
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      toastError(error);
      return false;
    }
  }
}

customElements.define('quick-key', QuickKey);
