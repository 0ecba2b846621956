/** The register of assets: search, edit, import from a table and save as one. */

import { html, render } from '../../../core/page/html.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { deleteAsset, loadAsset, saveAsset } from '../../../core/survey/register.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { chainage, count, date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { assetPath } from '../archive-assets/asset-table.js';
import { archivePage, showFault } from '../archive-shell/archive-shell.js';
import { editAsset } from '../asset-form/asset-form.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import '../../shared/pager/pager.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { importAssets } from './import-dialog.js';

const POLL_S = 30;

export class ArchiveRegister extends Component {
  #list;

  mount() {
    /** @type {Parts<'archive-register/archive-register'>} */
    this.parts = render(
      this,
      archivePage({
        title: t('archive.register'),
        ways: html`<a class="button" href="/api/register/assets.csv" download>${icon('download')}${t('register.export')}</a>
          <button class="button" data-import data-needs="operator">${icon('upload')}${t('register.import')}</button>
          <button class="button button--primary" data-add data-needs="operator">${icon('plus')}${t('register.add')}</button>`,
        content: html`<search class="row gap-3 wrap below-4"><div class="field find__text"><label class="visually-hidden" for="register-text">${t('register.search')}</label>
            <input class="input" id="register-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('register.search')}" data-part="text" /></div></search>
          <p class="dim" role="status" data-part="found"></p>
          <data-table class="register" data-part="table"></data-table>
          <div class="panel find__nothing row gap-3 wrap pad-4" data-part="nothing" hidden></div>
          <list-pager data-part="pager"></list-pager>`,
      }),
    );
    const { parts, signal } = this;
    this.#list = new PagedList('/api/register/assets', { filters: ['search'], signal });
    const list = this.#list;
    parts.text.value = list.filters.search;
    parts.table.fill({ caption: t('archive.register'), columns: columns(), keyOf: ({ asset_id: id }) => id });
    parts.pager.fill(list);
    this.listen(parts.text, 'input', () => orToast(() => list.want({ search: parts.text.value })));
    this.listen(list, 'change', () => this.#show());
    this.listen(this, 'click', ({ target }) => {
      const { edit, remove, import: isImport, add } = target.closest('button')?.dataset ?? {};
      if (isImport !== undefined) orToast(() => this.#import());
      if (add !== undefined) orToast(() => this.#edit());
      if (edit !== undefined) orToast(() => this.#edit(edit));
      if (remove !== undefined) orToast(() => this.#delete(remove));
    });
    list.follow(
      () => POLL_S,
      (error) => showFault(parts.fault, error),
    );
  }

  #show() {
    const { parts } = this;
    const { assets, total } = this.#list.value;
    parts.table.show(assets);
    parts.table.hidden = total === 0;
    parts.found.textContent = total > 0 ? t('register.found', { n: total, count: count(total) }) : '';
    parts.nothing.hidden = total > 0;
    render(parts.nothing, this.#list.isFiltered ? html`<p>${t('register.nothing')}</p>` : emptyRegister());
  }

  async #import() {
    const done = await importAssets();
    if (done)
      toast(
        t('register.imported', {
          n: done.added + done.changed,
          added: count(done.added),
          changed: count(done.changed),
        }),
      );
    await this.#list.again();
  }

  async #edit(assetId) {
    const saved = await editAsset(assetId);
    if (!saved) return;
    toast(t('register.saved', { id: saved.asset_id }));
    await this.#list.again();
  }

  async #delete(assetId) {
    const asset = this.#list.value.assets.find(({ asset_id: id }) => id === assetId);
    try {
      await deleteAsset(asset);
    } finally {
      await this.#list.again(); // a refusal means that others have changed it
    }
    this.parts.text.focus(); // the row with the button is gone
    const run = () =>
      orToast(async () => {
        if (await loadAsset(assetId))
          toast(t('register.exists', { id: assetId })); // somebody has added it again
        else await saveAsset(asset);
        await this.#list.again();
      });
    toast(t('register.deleted', { id: assetId }), { action: t('page.undo'), run });
  }
}

const emptyRegister = () => html`<h2>${t('register.empty')}</h2>
  <p>${t('register.empty_text')}</p>
  <p><a class="button" href="/api/register/template.csv" download>${icon('download')}${t('register.template')}</a>
    <button class="button button--primary" data-import data-needs="operator">${icon('upload')}${t('register.import')}</button></p>`;

/** 'Circular 600 mm', 'Rectangular 900 × 600 mm'. */
function sectionOf({ shape, height_mm: height, width_mm: width }) {
  const size = [width, height].filter((mm) => mm !== undefined).join(' × ');
  return [shape && wordFor('header.choice', shape), size && `${size} mm`].filter(Boolean).join(' ');
}

const orDash = (text) => (text ? html`${text}` : html`<span class="dim">–</span>`);

const placeOf = (line) => line.slice(0, 1).map(([lon, lat]) => `${lat.toFixed(5)}, ${lon.toFixed(5)}`)[0];

const columns = () => [
  {
    name: 'asset',
    title: t('archive.asset'),
    cell: ({ asset_id: id, header: { road, location_text: where } }) => html`<a href="${assetPath(id)}">${id}</a>
      <small>${[road, where].filter(Boolean).join(' · ')}</small>`,
  },
  { name: 'project', title: t('archive.project'), cell: ({ project }) => orDash(project) },
  {
    name: 'section',
    title: t('header.shape'),
    cell: ({ header }) => html`${orDash(sectionOf(header))}<small>${header.material}</small>`,
  },
  {
    name: 'length',
    title: t('register.length'),
    cell: ({ header: { known_length_m: known, expected_length_m: expected } }) =>
      html`<span class="number">${orDash((known ?? expected) !== undefined && chainage(known ?? expected))}</span>`,
  },
  {
    name: 'place',
    title: t('register.place'),
    cell: ({ line }) =>
      html`<span class="number">${orDash(placeOf(line))}</span>${line.length > 1 && html`<small>${t('register.points', { n: line.length })}</small>`}`,
  },
  {
    name: 'changed',
    title: t('register.changed'),
    cell: ({ changed_at: at, changed_by: who }) => html`<span class="number">${date(at)}</span><small>${who}</small>`,
  },
  ...(may('operator') ? [{ name: 'ways', title: t('register.ways'), cell: waysOf }] : []),
];

const waysOf = ({ asset_id: id }) => html`<span class="register__ways">
  <button class="button button--small button--icon" data-edit="${id}" aria-label="${t('register.edit_named', { id })}" title="${t('register.edit_named', { id })}">${icon('edit')}</button>
  <button class="button button--small button--icon" data-remove="${id}" aria-label="${t('register.delete_named', { id })}" title="${t('register.delete_named', { id })}">${icon('trash')}</button></span>`;

customElements.define('archive-register', ArchiveRegister);
