/**
 * A table of one page of a `PagedList`: columns that sort, rows that stay while their cells change, arrows
 * that move from row to row. On a narrow window each row is a card.
 */

import { html, patchList, render, renderNew } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { followSorting, sortButton } from './sorting.js';

/**
 * @typedef {object} Column
 * @property {string} name
 * @property {string|ReturnType<typeof html>} title the cards of a narrow window show a text only
 * @property {string} [sort] name by which the server sorts; none: it cannot
 * @property {string} [width] as in CSS, while the window is wide
 * @property {boolean} [descends] whether the first click sorts the other way round
 * @property {(item: object) => ReturnType<typeof html>} cell
 */

/** A column that the first click sorts from its smallest value. @returns {Column} */
export const column = (name, title, cell, sort = undefined, width = undefined) => ({ name, title, cell, sort, width });

/** A column of figures, days or grades, which the first click sorts from the largest; null is a dash. */
export const figures = (name, title, valueOf, sort = name, width = undefined) => ({
  name,
  title,
  sort,
  width,
  descends: true,
  cell: (item) => orDash(valueOf(item)),
});

/** A figure as text, markup as it is, or a dash in place of nothing. */
export function orDash(value) {
  if (value === null || value === undefined || value === '') return html`<span class="dim">–</span>`;
  return typeof value === 'object' ? value : html`<span class="number">${value}</span>`;
}

export class DataTable extends Component {
  #columns;
  #keyOf;

  /**
   * @param {object} options
   * @param {string} options.caption for screen readers
   * @param {Column[]} options.columns
   * @param {(item: object) => string} options.keyOf
   * @param {import('../../../core/page/paged-list.js').PagedList} [options.list] sorts; without it nothing does
   * @param {{sort: string, descending: string}} [options.usual] order where none is chosen
   */
  fill({ caption, columns, keyOf, list, usual }) {
    this.#columns = columns;
    this.#keyOf = keyOf;
    /** @type {Parts<'data-table/data-table'>} */
    this.parts = render(
      this,
      html`<table class="table" role="table">
        <caption class="visually-hidden">${caption}</caption>
        <thead role="rowgroup"><tr role="row">${columns.map(
          ({
            name,
            title,
            sort,
            descends,
          }) => html`<th role="columnheader" class="table__${name}" scope="col" data-column="${name}">
            ${sort && list ? sortButton(sort, title, descends) : title}</th>`,
        )}</tr></thead>
        <tbody role="rowgroup" data-part="rows"></tbody></table>`,
    );
    for (const { name, width = '' } of columns) this.querySelector(`[data-column=${name}]`).style.width = width;
    this.listen(this.parts.rows, 'keydown', (event) => this.#move(event));
    if (list) followSorting(this, list, this.signal, usual);
  }

  /** Shows these rows. */
  show(items) {
    patchList(
      this.parts.rows,
      items,
      this.#keyOf,
      () => this.#createRow(),
      (row, item) => this.#update(row, item),
    );
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
    this.#columns.forEach(({ cell }, i) => renderNew(row.children[i], cell(item)));
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
