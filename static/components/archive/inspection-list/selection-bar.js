/** The selected inspections, and what is done with all of them. */

import { get, post } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { Selection } from '../../../core/defects/selection.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { openBulkExport } from '../bulk-export/bulk-export.js';
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
        <button class="button button--small button--primary" data-part="export">${icon('download')}${t('list.export')}</button>
      </div>`,
    );
  }

  /**
   * @param {import('../../../core/page/paged-list.js').PagedList} list
   * @param {Element} boxes holds the boxes of the rows and of the whole page
   */
  fill(list, boxes) {
    const selection = this.#selection;
    this.#list = list;
    this.#boxes = boxes;
    let shown = this.#where();
    this.listen(list, 'change', () => {
      // "All that fit" would silently become other inspections.
      if (selection.isAll && this.#where() !== shown) selection.clear();
      shown = this.#where();
    });
    this.listen(boxes, 'click', ({ target, shiftKey }) => {
      const { checked: isSelected } = target;
      if (target.matches('[data-mark-page]')) selection.mark(this.#page, isSelected);
      else if (target.matches('[data-mark]'))
        selection.markOne(this.#page, target.dataset.mark, { isSelected, isRange: shiftKey });
    });
    // Shift would select the text between both clicks.
    this.listen(
      boxes,
      'mousedown',
      (event) => event.shiftKey && event.target.closest('.inspection__mark') && event.preventDefault(),
    );
    this.listen(this.parts.all, 'click', () => selection.markAll(this.#where(), list.total));
    this.listen(this.parts.none, 'click', () => {
      selection.clear();
      boxes.querySelector('[data-mark-page]').focus(); // the button has gone
    });
    this.listen(this.parts.export, 'click', () => orToast(() => this.#export()));
    this.listen(this.parts.again, 'click', () => orToast(() => this.#trackAgain()));
    this.listen(selection, 'change', () => this.show());
  }

  get #page() {
    return this.#list.value?.inspections ?? [];
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
    const page = this.#page;
    for (const box of this.#boxes.querySelectorAll('[data-mark]')) {
      box.checked = selection.has(box.dataset.mark);
      box.closest('.inspection').classList.toggle('inspection--selected', box.checked);
    }
    const onPage = page.filter(({ id }) => selection.has(id)).length;
    const whole = this.#boxes.querySelector('[data-mark-page]');
    whole.checked = page.length > 0 && onPage === page.length;
    whole.indeterminate = onPage > 0 && onPage < page.length;
    this.hidden = selection.size === 0;
    setText(parts.chosen, t('list.selected', { n: selection.size, count: count(selection.size) }));
    setText(parts.all, t('archive.select_all', { n: this.#list.total, count: count(this.#list.total) }));
    // Of inspections on other pages only the filter is known.
    const areOutdated = selection.isAll
      ? this.#list.filters.outdated
      : selection.items.every(({ outdated }) => outdated);
    parts.again.hidden = !areOutdated;
    parts.all.hidden = selection.isAll || this.#list.total <= page.length;
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
