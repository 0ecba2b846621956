/**
 * A table of one page of a `PagedList`: columns that sort, rows that stay while their cells change, arrows
 * that move from row to row. On a narrow window each row is a card.
 */

import { html, patchList, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { t } from '../../core/words.js';
import { orToast } from '../toast-stack/toast-stack.js';

/**
 * @typedef {object} Column
 * @property {string} name
 * @property {string} title
 * @property {string} [sort] name by which the server sorts; none: it cannot
 * @property {boolean} [descends] whether the first click sorts the other way round
 * @property {(item: object) => ReturnType<typeof html>} cell
 */

class DataTable extends Component {
  #columns;
  #keyOf;
  /** Markup of each cell as last rendered: an unchanged one keeps its focus. */
  #shown = new WeakMap();

  /**
   * @param {object} options
   * @param {string} options.caption for screen readers
   * @param {Column[]} options.columns
   * @param {(item: object) => string} options.keyOf
   * @param {import('../../core/paged-list.js').PagedList} [options.list] sorts; without it nothing does
   */
  fill({ caption, columns, keyOf, list }) {
    this.#columns = columns;
    this.#keyOf = keyOf;
    this.parts = render(
      this,
      html`<table class="table" role="table">
        <caption class="visually-hidden">${caption}</caption>
        <thead role="rowgroup"><tr role="row">${columns.map(
          ({ name, title, sort }) => html`<th role="columnheader" class="table__${name}" scope="col" data-column="${name}">
            ${sort && list ? html`<button class="table__sort" data-sort="${sort}">${title}<span aria-hidden="true"></span></button>` : title}</th>`,
        )}</tr></thead>
        <tbody role="rowgroup" data-part="rows"></tbody></table>`,
    );
    this.listen(this.parts.rows, 'keydown', (event) => this.#move(event));
    if (!list) return;
    this.listen(this, 'click', ({ target }) => {
      const button = target.closest('[data-sort]');
      if (button) orToast(() => this.#sort(list, button.dataset.sort));
    });
    this.listen(list, 'change', () => this.#showOrder(list.filters));
  }

  /** Shows these rows. */
  show(items) {
    patchList(this.parts.rows, items, this.#keyOf, () => this.#createRow(), (row, item) => this.#update(row, item));
  }

  #createRow() {
    const row = document.createElement('tr');
    row.setAttribute('role', 'row');
    for (const { name, title } of this.#columns) {
      const cell = document.createElement('td');
      cell.setAttribute('role', 'cell');
      cell.className = `table__${name}`;
      if (typeof title === 'string') cell.dataset.label = title;
      row.append(cell);
    }
    return row;
  }

  #update(row, item) {
    this.#columns.forEach(({ cell }, i) => {
      const markup = cell(item);
      if (this.#shown.get(row.children[i]) === markup.text) return;
      this.#shown.set(row.children[i], markup.text);
      render(row.children[i], markup);
    });
  }

  #sort(list, name) {
    const { descends } = this.#columns.find(({ sort }) => sort === name);
    const { sort, descending } = list.filters;
    const isDescending = sort === name ? descending !== 'true' : Boolean(descends);
    return list.want({ sort: name, descending: String(isDescending) });
  }

  #showOrder({ sort, descending }) {
    for (const head of this.querySelectorAll('th')) {
      const button = head.querySelector('[data-sort]');
      if (!button) continue;
      const isSorted = button.dataset.sort === sort;
      const order = descending === 'true' ? 'descending' : 'ascending';
      if (isSorted) head.setAttribute('aria-sort', order);
      else head.removeAttribute('aria-sort');
      button.title = isSorted && order === 'ascending' ? t('table.sort_down') : t('table.sort_up');
    }
  }

  /** Up and Down go to the same control of the next row. */
  #move(event) {
    const step = { ArrowDown: 'nextElementSibling', ArrowUp: 'previousElementSibling' }[event.key];
    const cell = event.target.closest('td');
    const row = cell?.parentElement[step ?? ''];
    if (!row || event.target.matches('select, input:not([type=checkbox])')) return;
    const controls = (within) => [...within.querySelectorAll('a[href], button, input')];
    const column = [...cell.parentElement.children].indexOf(cell);
    const next = controls(row.children[column])[0] ?? controls(row)[0];
    if (!next) return;
    event.preventDefault();
    next.focus();
  }
}

customElements.define('data-table', DataTable);
