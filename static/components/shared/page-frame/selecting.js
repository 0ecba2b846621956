/** Boxes in the rows of a list that select them, over its pages, or all that fit its filters. */

import { setText } from '../../../core/page/html.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/**
 * @param {import('../../../core/page/store.js').Component} page with the parts `all` and `none`, buttons
 * @param {object} around
 * @param {import('../../../core/defects/selection.js').Selection<any, any>} around.selection
 * @param {import('../../../core/page/paged-list.js').PagedList} around.list
 * @param {Element} around.boxes holds the boxes of the rows, and that of the whole page
 * @param {() => {id: string}[]} around.rows those of the page
 * @param {() => string|object} around.where the filters that are set, as the selection keeps them
 */
export function selectRows(page, { selection, list, boxes, rows, where }) {
  const { all, none } = page.parts;
  const filters = () => JSON.stringify(where());
  let shown = filters();
  page.listen(list, 'change', () => {
    // "All that fit" would silently become other rows.
    if (selection.isAll && filters() !== shown) selection.clear();
    shown = filters();
  });
  page.listen(boxes, 'click', ({ target, shiftKey: isRange }) => {
    const { checked: isSelected } = target;
    if (target.matches('[data-mark-page]')) selection.mark(rows(), isSelected);
    else if (target.matches('[data-mark]')) selection.markOne(rows(), target.dataset.mark, { isSelected, isRange });
  });
  page.listen(all, 'click', () => selection.markAll(where(), list.total));
  page.listen(none, 'click', () => {
    selection.clear();
    boxes.querySelector('[data-mark-page]').focus(); // the button has gone
  });
}

/** Shows what is selected of the present page, and how much more could be. */
export function showSelected({ all, none }, { selection, list, boxes, rows }) {
  for (const box of boxes.querySelectorAll('[data-mark]')) box.checked = selection.has(box.dataset.mark);
  const page = rows();
  const onPage = page.filter(({ id }) => selection.has(id)).length;
  const whole = boxes.querySelector('[data-mark-page]');
  whole.checked = page.length > 0 && onPage === page.length;
  whole.indeterminate = onPage > 0 && onPage < page.length;
  setText(all, t('archive.select_all', { n: list.total, count: count(list.total) }));
  all.hidden = selection.isAll || list.total === 0;
  none.hidden = selection.size === 0;
}
