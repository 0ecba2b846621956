/** All inspections, the newest first unless sorted otherwise, updated while something runs. */

import { patch, remove, sendFile } from '../../../core/server/api.js';
import { html, patchList, render } from '../../../core/page/html.js';
import { isUnfinished } from '../../../core/survey/inspection.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { isArchive } from '../../../core/server/upload.js';
import { errorText, language, t } from '../../../core/page/words.js';
import { followSorting, sortButton } from '../../shared/data-table/sorting.js';
import { icon } from '../../shared/icon/icon.js';
import { editLabels } from '../labels/labels.js';
import { followThumbnails } from '../../shared/thumbnail/thumbnail.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { topBar } from '../../shared/top-bar/top-bar.js';
import '../../shared/pager/pager.js';
import '../../work/work-page/sample-button.js';
import { importArchive } from './archive-import.js';
import { askDelete, askName, showImported } from './dialogs.js';
import { FILTERS } from './list-filters.js';
import { createRow, updateRow } from './row.js';
import './selection-bar.js';

const POLL_BUSY_S = 1.5;
/** Pause while nothing runs: others may tag any inspection, and severe defects must show at once. */
const POLL_IDLE_S = 3;

export class InspectionList extends Component {
  #list;
  /** Ids of inspections whose urgent defects were announced or already there; null before the first answer. */
  #grave = null;

  mount() {
    document.title = t('list.page');
    /** @type {Parts<'inspection-list/inspection-list'>} */
    this.parts = render(
      this,
      html`${topBar()}
        <main id="main" class="content" tabindex="-1">
          <div class="content__head">
            <h1>${t('list.title')}</h1>
            <div class="content__ways"><a class="button" href="/compare" data-part="compare" hidden>${t('compare.link')}</a>
              <button class="button" data-part="old" data-needs="operator" title="${t('list.import_help')}">${icon('upload')}${t('list.import')}</button>
              <input type="file" accept=".txt,.json,.db3,.xml,.ribx,.zip" data-part="file" aria-label="${t('list.import')}" hidden />
              <a class="button button--primary" href="/new" data-needs="operator">${icon('plus')}${t('list.new')}</a></div>
          </div>
          <p class="message message--error" data-part="fault" role="alert" hidden></p>
          <section class="panel empty stack gap-4 at-start" data-part="empty" hidden>
            <h2>${t('list.empty')}</h2>
            <p class="dim">${t('list.empty_text')}</p>
            <div class="flow gap-3" data-needs="operator">
              <a class="button button--primary" href="/new">${icon('plus')}${t('list.first')}</a>
              <sample-button></sample-button>
            </div>
          </section>
          <div data-part="table" hidden>
            <list-filters data-part="filters"></list-filters>
            <div class="inspections">
              <div class="inspections__head help" role="group" aria-label="${t('list.sort')}" data-part="head">
                <label class="inspection__mark"><span class="visually-hidden">${t('archive.select_page')}</span><input type="checkbox" data-mark-page /></label>
                <span class="inspections__wide">${sortButton('name', t('list.name'))}${sortButton('asset', t('archive.asset'))}${sortButton('project', t('archive.project'))}</span>
                <span>${sortButton('status', t('list.status'))}${sortButton('review_state', t('tab.review'))}</span>
                <span>${sortButton('distance_m', t('list.length'), true)}</span><span>${sortButton('defects', t('list.defects'), true)}</span>
                <span>${sortButton('worst_severity', t('list.worst'), true)}</span><span>${sortButton('created_at', t('list.created'), true)}</span>
              </div>
              <ul data-part="rows" aria-label="${t('list.title')}"></ul>
              <selection-bar data-part="selection"></selection-bar>
              <list-pager data-part="pager"></list-pager>
              <p class="panel row gap-3 wrap pad-4" data-part="nothing" hidden>${t('list.nothing')}
                <button class="button button--small" data-part="clear">${t('list.clear')}</button></p>
            </div>
          </div>
        </main>`,
    );
    const { clear, old, file, filters, pager, head, rows, selection } = this.parts;
    this.listen(old, 'click', () => file.click());
    this.listen(file, 'change', () => orToast(() => this.#import()));
    const list = new PagedList('/api/inspections', {
      filters: [...FILTERS, 'sort', 'descending'],
      signal: this.signal,
    });
    this.#list = list;
    filters.fill(list, this.parts.table);
    pager.fill(list);
    selection.fill(list, head.parentElement);
    followSorting(head, list, this.signal, { sort: 'created_at', descending: 'true' });
    followThumbnails(rows, this.signal);
    this.listen(clear, 'click', () => filters.clear());
    this.listen(this.#list, 'change', () => this.#show());
    this.#list.follow(
      ({ inspections = [] }) => (inspections.some(isUnfinished) ? POLL_BUSY_S : POLL_IDLE_S),
      (error) => this.#showFault(error),
    );
  }

  /** Announces inspections with a defect that became urgent while the page is open. */
  #announceGrave(grave) {
    const isFirst = this.#grave === null;
    this.#grave ??= { ids: new Set(), newest: '' };
    const { ids, newest } = this.#grave;
    for (const { id, name, at } of grave) {
      if (!isFirst && !ids.has(id) && at > newest) this.#announce(id, name);
      ids.add(id);
      if (at > this.#grave.newest) this.#grave.newest = at;
    }
  }

  #announce(id, name) {
    toast(t('list.grave', { name }), {
      kind: 'error',
      action: t('list.open'),
      run: () => location.assign(`/inspections/${id}`),
    });
  }

  #show() {
    const { parts } = this;
    const { inspections, total, stored, grave } = this.#list.value;
    this.#announceGrave(grave);
    parts.empty.hidden = stored > 0;
    parts.table.hidden = stored === 0;
    parts.compare.hidden = stored < 2;
    parts.nothing.hidden = total > 0 || stored === 0;
    parts.filters.showCount(total < stored ? t('list.found', { shown: count(total), all: count(stored) }) : '');
    patchList(
      parts.rows,
      inspections,
      ({ id }) => id,
      (item) => this.#createRow(item),
      updateRow,
    );
    parts.selection.show();
  }

  #inspection(id) {
    return this.#list.value.inspections.find((other) => other.id === id);
  }

  #createRow({ id }) {
    const item = createRow(id);
    item.parts.label.addEventListener('click', () => orToast(() => this.#label(id)));
    item.parts.rename.addEventListener('click', () => orToast(() => this.#rename(id)));
    item.parts.remove.addEventListener('click', () => orToast(() => this.#delete(id)));
    return item;
  }

  #label(id) {
    return editLabels(this.#inspection(id), async () => {
      await Promise.all([this.#list.again(), this.parts.filters.offerLabels()]);
    });
  }

  async #rename(id) {
    const { name } = this.#inspection(id);
    const wanted = await askName(name);
    if (wanted === null) return;
    await patch(`/api/inspections/${id}`, { name: wanted });
    await this.#list.again();
    toast(t('list.renamed', { name: wanted }));
  }

  async #delete(id) {
    const inspection = this.#inspection(id);
    if (!(await askDelete(inspection))) return;
    await remove(`/api/inspections/${id}`);
    await this.#list.again();
    this.parts.selection.forget(id);
    this.querySelector('#main').focus();
    toast(t('list.deleted', { name: inspection.name }));
  }

  /** Imports old surveys of other programs, and exported inspections; the server detects the format. */
  async #import() {
    const { old, file } = this.parts;
    const [chosen] = file.files;
    if (!chosen) return;
    old.disabled = true;
    try {
      const path = `/api/imports?filename=${encodeURIComponent(chosen.name)}&lang=${language}`;
      const imported = isArchive(chosen) ? await importArchive(chosen) : await sendFile(path, chosen, this.signal);
      if (!imported) return;
      await this.#list.again();
      showImported(chosen.name, imported);
    } finally {
      file.value = ''; // so that the same file may be chosen again
      old.disabled = false;
    }
  }

  #showFault(error) {
    this.parts.fault.hidden = error === null;
    if (!error) return;
    const reason = errorText(error);
    const text = error.isTemporary ? t('page.trying_again', { reason }) : reason;
    render(this.parts.fault, html`${icon('alert')}<span>${text}</span>`);
  }
}

customElements.define('inspection-list', InspectionList);
