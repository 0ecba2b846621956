/** The selected inspections, and what is done with all of them. */

import { get, post } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { Selection } from '../../../core/defects/selection.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { selectRows, showSelected } from '../../shared/page-frame/selecting.js';
import { openBulkExport } from '../bulk-export/bulk-export.js';
import { openAcceptance } from '../../reports/acceptance/acceptance.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { FILTERS } from './list-filters.js';

export class SelectionBar extends Component {
  /** @type {Selection<Api['InspectionOut'], string>} */
  #selection = new Selection();
  #list;
  #boxes;

  mount() {
    this.hidden = true;
    /** @type {Parts<'inspection-list/selection-bar'>} */
    this.parts = render(
      this,
      html`<div class="selection-bar row wrap pad-row below-2 panel" role="group" aria-label="${t('list.selected_actions')}">
        <p class="number selection-bar__chosen" role="status" data-part="chosen"></p>
        <button class="button button--small" data-part="all"></button>
        <button class="button button--small button--quiet" data-part="none">${t('archive.select_none')}</button>
        <button class="button button--small" data-part="again" data-needs="operator">${icon('retry')}${t('desk.retry')}</button>
        <button class="button button--small" data-part="accept" data-needs="operator">${icon('link')}${t('acceptance.title')}</button>
        <button class="button button--small button--primary" data-part="export">${icon('download')}${t('list.export')}</button>
      </div>`,
    );
  }

  /**
   * @param {import('../../../core/page/paged-list.js').PagedList} list
   * @param {Element} boxes holds the boxes of the rows and of the whole page
   */
  fill(list, boxes) {
    this.#list = list;
    this.#boxes = boxes;
    selectRows(this, this.#selecting);
    // Shift would select the text between both clicks.
    this.listen(
      boxes,
      'mousedown',
      (event) => event.shiftKey && event.target.closest('.inspection__mark') && event.preventDefault(),
    );
    this.listen(this.parts.export, 'click', () => orToast(() => this.#export()));
    this.listen(this.parts.accept, 'click', () => orToast(async () => openAcceptance(await this.#ids())));
    this.listen(this.parts.again, 'click', () => orToast(() => this.#trackAgain()));
    this.listen(this.#selection, 'change', () => this.show());
  }

  get #page() {
    return this.#list.value?.inspections ?? [];
  }

  get #selecting() {
    const [selection, list, boxes] = [this.#selection, this.#list, this.#boxes];
    return { selection, list, boxes, rows: () => this.#page, where: () => this.#where() };
  }

  /** The chosen filters, as a query. */
  #where() {
    const { filters } = this.#list;
    return String(new URLSearchParams(FILTERS.filter((name) => filters[name]).map((name) => [name, filters[name]])));
  }

  /** Leaves out an inspection that was deleted. */
  forget(id) {
    this.#selection.forget([id], this.#list.total);
  }

  /** Shows what is selected of the present page. */
  show() {
    const selection = this.#selection;
    const { parts } = this;
    showSelected(parts, this.#selecting);
    this.hidden = selection.size === 0;
    setText(parts.chosen, t('list.selected', { n: selection.size, count: count(selection.size) }));
    // Of inspections on other pages only the filter is known.
    const areOutdated = selection.isAll
      ? this.#list.filters.outdated
      : selection.items.every(({ outdated }) => outdated);
    parts.again.hidden = !areOutdated;
    parts.all.hidden = selection.isAll || this.#list.total <= this.#page.length;
  }

  async #ids() {
    const { isAll, meant } = this.#selection;
    return isAll ? (await get(`/api/inspections/ids?${meant.where}`, this.signal)).ids : meant.ids;
  }

  async #export() {
    openBulkExport(await this.#ids());
  }

  async #trackAgain() {
    const { queued } = await post('/api/inspections/retry', { ids: await this.#ids() });
    this.#selection.clear();
    await this.#list.again();
    toast(t('outdated.queued', { n: queued, count: count(queued) }));
  }
}

customElements.define('selection-bar', SelectionBar);
