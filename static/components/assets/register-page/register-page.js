/** The register of assets: search, edit, import from a table and save as one. */

import { html, render } from '../../../core/page/html.js';
import { deleteAsset, loadAsset, saveAsset } from '../../../core/survey/register.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { chainage, count, date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { assetPath } from '../assets-page/asset-table.js';
import { framedPage } from '../../shared/page-frame/page-frame.js';
import { followList, searchMarkup, tableMarkup } from '../../shared/page-frame/list-page.js';
import { editAsset } from '../asset-form/asset-form.js';
import { column, orDash } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import './register-import.js';

const POLL_S = 30;

export class RegisterPage extends Component {
  #list;

  mount() {
    /** @type {Parts<'register-page/register-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.register'),
        ways: html`<a class="button" href="/api/register/assets.csv" download>${icon('download')}${t('register.export')}</a>
          <a class="button" href="/api/register/template.csv" download>${icon('download')}${t('register.template')}</a>
          <button class="button" data-import data-needs="operator">${icon('upload')}${t('register.import')}</button>
          <button class="button button--primary" data-add data-needs="operator">${icon('plus')}${t('register.add')}</button>`,
        content: html`<register-import data-part="importing"></register-import>
          <input type="file" accept=".csv,.txt,.tsv,text/csv" aria-label="${t('register.import')}" data-part="file" hidden />
          <div data-part="listed">${searchMarkup(t('register.search'))}
          <p class="dim" role="status" data-part="found"></p>${tableMarkup('register', '')}</div>`,
      }),
    );
    this.#list = followList(this, {
      path: '/api/register/assets',
      filters: ['search'],
      rows: 'assets',
      caption: t('archive.register'),
      columns: columns(),
      keyOf: ({ asset_id: id }) => id,
      show: ({ total }) => this.#show(total),
      pauseAfter: () => POLL_S,
    });
    this.#followFiles();
    this.listen(this, 'click', ({ target }) => {
      const { edit, remove, import: isImport, add } = target.closest('button')?.dataset ?? {};
      if (isImport !== undefined) this.parts.file.click();
      if (add !== undefined) orToast(() => this.#edit());
      if (edit !== undefined) orToast(() => this.#edit(edit));
      if (remove !== undefined) orToast(() => this.#delete(remove));
    });
  }

  #followFiles() {
    const { file, importing, listed } = this.parts;
    this.listen(file, 'change', () => {
      if (file.files[0]) this.#import(file.files[0]);
      file.value = ''; // so that the repaired file can be chosen again
    });
    const hasFiles = ({ dataTransfer: { types } }) => may('operator') && types.includes('Files');
    this.listen(this, 'dragover', (event) => hasFiles(event) && event.preventDefault());
    this.listen(this, 'drop', (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.#import(event.dataTransfer.files[0]);
    });
    this.listen(importing, 'done', ({ detail: done }) => {
      listed.hidden = false;
      if (done)
        toast(
          t('register.imported', {
            n: done.added + done.changed,
            added: count(done.added),
            changed: count(done.changed),
          }),
          { action: t('work.title'), run: () => location.assign('/') },
        );
      orToast(() => this.#list.again());
    });
  }

  #import(file) {
    this.parts.listed.hidden = true;
    this.parts.importing.open(file);
  }

  #show(total) {
    const { found, nothing } = this.parts;
    found.textContent = total > 0 ? t('register.found', { n: total, count: count(total) }) : '';
    render(nothing, this.#list.isFiltered ? html`<p>${t('register.nothing')}</p>` : emptyRegister());
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
  <p>${t('register.empty_text')} ${t('register.drop')}</p>
  <p><button class="button button--primary" data-import data-needs="operator">${icon('upload')}${t('register.import')}</button></p>`;

/** 'Circular 600 mm', 'Rectangular 900 × 600 mm'. */
export function sectionOf({ shape, height_mm: height, width_mm: width }) {
  const size = [width, height].filter((mm) => mm !== undefined).join(' × ');
  return [shape && wordFor('header.choice', shape), size && `${size} mm`].filter(Boolean).join(' ');
}

const placeOf = (line) => line.slice(0, 1).map(([lon, lat]) => `${lat.toFixed(5)}, ${lon.toFixed(5)}`)[0];

const columns = () => [
  column(
    'asset',
    t('archive.asset'),
    ({ asset_id: id, header: { road, location_text: where } }) => html`<a href="${assetPath(id)}">${id}</a>
      <small>${[road, where].filter(Boolean).join(' · ')}</small>`,
    undefined,
    '22%',
  ),
  column('project', t('archive.project'), ({ project }) => (project ? html`${project}` : orDash(null))),
  column(
    'section',
    t('header.shape'),
    ({ header }) => html`${orDash(sectionOf(header))}<small>${header.material}</small>`,
  ),
  column('length', t('register.length'), ({ header: { known_length_m: known, expected_length_m: expected } }) =>
    orDash((known ?? expected) && chainage(known ?? expected)),
  ),
  column(
    'place',
    t('register.place'),
    ({ line }) =>
      html`${orDash(placeOf(line))}${line.length > 1 && html`<small>${t('register.points', { n: line.length })}</small>`}`,
  ),
  column(
    'changed',
    t('register.changed'),
    ({ changed_at: at, changed_by: who }) => html`<span class="number">${date(at)}</span><small>${who}</small>`,
  ),
  ...(may('operator') ? [column('ways', t('register.ways'), waysOf)] : []),
];

const waysOf = ({ asset_id: id }) => html`<span class="inline-row gap-1">
  <button class="button button--small button--icon" data-edit="${id}" aria-label="${t('register.edit_named', { id })}" title="${t('register.edit_named', { id })}">${icon('edit')}</button>
  <button class="button button--small button--icon" data-remove="${id}" aria-label="${t('register.delete_named', { id })}" title="${t('register.delete_named', { id })}">${icon('trash')}</button></span>`;

customElements.define('register-page', RegisterPage);
