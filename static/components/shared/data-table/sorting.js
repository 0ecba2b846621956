/** Heads that sort a `PagedList`. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { orToast } from '../toast-stack/toast-stack.js';

/**
 * @param {string} sort name by which the server sorts
 * @param {import('./data-table.js').Column['title']} title
 * @param {boolean} [descends] whether the first click sorts the other way round
 */
export const sortButton = (sort, title, descends = false) =>
  html`<button class="table__sort bare inline-row gap-1" data-sort="${sort}" ${descends && 'data-descends'}>${title}<span aria-hidden="true"></span></button>`;

/**
 * Sorts the list by a click on a head within the element, and shows by which one it is sorted.
 * @param {Element} element
 * @param {import('../../../core/page/paged-list.js').PagedList} list
 * @param {AbortSignal} signal
 * @param {{sort?: string, descending?: string}} [usual] order of the server where none is chosen
 */
export function followSorting(element, list, signal, usual = {}) {
  const order = () => (list.filters.sort ? list.filters : usual);
  const sort = ({ dataset }) => {
    const { sort: name, descending } = order();
    const isDescending = name === dataset.sort ? descending !== 'true' : dataset.descends !== undefined;
    return list.want({ sort: dataset.sort, descending: String(isDescending) });
  };
  element.addEventListener(
    'click',
    ({ target }) => {
      const button = /** @type {Element} */ (target).closest('[data-sort]');
      if (button) orToast(() => sort(button));
    },
    { signal },
  );
  const show = () => {
    for (const button of element.querySelectorAll('[data-sort]')) showOrder(button, order());
  };
  list.addEventListener('change', show, { signal });
}

/** @param {HTMLElement} button @param {{sort?: string, descending?: string}} order */
function showOrder(button, { sort, descending }) {
  const isSorted = button.dataset.sort === sort;
  const order = descending === 'true' ? 'descending' : 'ascending';
  const head = button.closest('th');
  if (isSorted) button.dataset.order = order;
  else delete button.dataset.order;
  if (isSorted) head?.setAttribute('aria-sort', order);
  else head?.removeAttribute('aria-sort');
  // Outside a table nothing else says it to a screen reader.
  if (!head) button.setAttribute('aria-pressed', String(isSorted));
  button.title = isSorted && order === 'ascending' ? t('table.sort_down') : t('table.sort_up');
}
