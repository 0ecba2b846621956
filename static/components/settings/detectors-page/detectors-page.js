/** The models that find defects on the wall beside the built-in detector, for administrators: list, add, delete. */

import { get, remove } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { bytes, date } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { kindText } from '../../defects/finding-queue/words.js';
import { ask } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { framedPage } from '../../shared/page-frame/page-frame.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { addModel } from './model-dialog.js';

export class DetectorsPage extends Component {
  /** @type {Api['DetectorOut'][]} */
  #models = [];

  mount() {
    /** @type {Parts<'detectors-page/detectors-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('detectors.title'),
        ways:
          may('admin') &&
          html`<button class="button button--primary" data-part="add">${icon('plus')}${t('detectors.add')}</button>`,
        content: may('admin')
          ? html`<p class="dim users__intro">${t('detectors.intro')}</p><div data-part="list"></div>`
          : html`<p class="message">${icon('info')}<span>${t('rights.admin')}</span></p>`,
      }),
    );
    if (!may('admin')) return;
    const { add, list } = this.parts;
    this.listen(add, 'click', () => orToast(async () => (await addModel()) && this.#load()));
    this.listen(list, 'click', ({ target }) => {
      const button = target.closest('[data-delete]');
      if (button) orToast(() => this.#delete(this.#models[button.dataset.delete]));
    });
    orToast(() => this.#load());
  }

  async #load() {
    this.#models = (await get('/api/detectors', this.signal)).detectors;
    render(
      this.parts.list,
      this.#models.length === 0
        ? html`<p class="panel pad-4 dim">${t('detectors.none')}</p>`
        : html`<div class="users panel holds"><table>
          <thead><tr><th scope="col">${t('detectors.name')}</th><th scope="col">${t('detectors.finds')}</th><th scope="col">${t('detectors.input')}</th>
            <th scope="col">${t('detectors.size')}</th><th scope="col">${t('detectors.added')}</th><th><span class="visually-hidden">${t('detectors.delete')}</span></th></tr></thead>
          <tbody>${this.#models.map(rowMarkup)}</tbody></table></div>`,
    );
  }

  async #delete({ id, name }) {
    const text = t('detectors.delete_text', { name });
    if (!(await ask({ title: t('detectors.delete_title', { name }), text, submit: t('detectors.delete') }))) return;
    await remove(`/api/detectors/${id}`);
    await this.#load();
    this.parts.add.focus();
    toast(t('detectors.deleted', { name }));
  }
}

/** @param {Api['DetectorOut']} model @param {number} index */
function rowMarkup({ name, declared, size, created_by: who, created_at: at }, index) {
  const kinds = declared.classes.map(({ kind }) => kind).filter(Boolean);
  return html`<tr><th scope="row">${name}</th>
    <td>${kinds.map(kindText).join(', ')}</td>
    <td class="number">${t('detectors.pixels', { wide: declared.input[0], high: declared.input[1], mm: declared.mm_per_px })}</td>
    <td class="number">${bytes(size)}</td>
    <td class="number">${t('reviewing.by', { who, when: date(at) })}</td>
    <td><button class="button button--small" data-delete="${index}" aria-label="${t('detectors.delete_named', { name })}">${t('detectors.delete')}</button></td></tr>`;
}

customElements.define('detectors-page', DetectorsPage);
