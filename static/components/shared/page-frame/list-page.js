/** What the lists of the archive share: a field that searches, the filters that are set, a table and its pages. */

import { html, render } from '../../../core/page/html.js';
import { bindKeys } from '../../../core/page/keys.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { t } from '../../../core/page/words.js';
import { showKeys } from '../../desk/actions/key-help.js';
import '../data-table/data-table.js';
import { closesElsewhere } from '../menu/menu.js';
import '../pager/pager.js';
import { orToast } from '../toast-stack/toast-stack.js';
import { filterChips, followFilters, pendingNote, showFault } from './page-frame.js';

const POLL_S = 10;

/** A field that searches the list, and what else narrows it. */
export const searchMarkup = (hint, others = html``) => html`<search class="row gap-3 wrap below-4">
  <div class="field find__text"><label class="visually-hidden" for="list-text">${hint}</label>
    <input class="input" id="list-text" type="search" autocomplete="off" maxlength="200" placeholder="${hint}" data-part="text" /></div>
  ${others}<span class="find__filters" data-part="chips"></span></search>`;

/** The table, and what stands there while nothing fits. */
export const tableMarkup = (name, nothing) => html`<div data-part="pending"></div>
  <data-table class="${name}" data-part="table"></data-table>
  <div class="panel row gap-3 wrap pad-4" data-part="nothing" hidden>${nothing}</div>
  <list-pager data-part="pager"></list-pager>`;

/**
 * Fills the parts of both markups, and keeps them up to date.
 * @param {import('../../../core/page/store.js').Component} page has the parts, and `fault`
 * @param {object} declared
 * @param {string} declared.path of the API
 * @param {string[]} declared.filters names of the filters, which are also in the address
 * @param {string} declared.rows name of the rows in the answer
 * @param {string} declared.caption for screen readers
 * @param {import('../data-table/data-table.js').Column[]} declared.columns
 * @param {(item: object) => string} declared.keyOf
 * @param {{sort: string, descending: string}} [declared.usual] order where none is chosen
 * @param {(filters: Record<string, string>) => [string, string, string][]} [declared.chosen] filters without a field of
 *     their own: name, title, value
 * @param {(answer: object, list: PagedList) => void} [declared.show] shows what else depends on the answer
 * @param {(answer: object) => number} [declared.pauseAfter] seconds until the server is asked again
 * @returns {PagedList}
 */
export function followList(page, declared) {
  const { parts, signal } = page;
  const { path, filters, rows, caption, columns, keyOf, usual, chosen, show, pauseAfter = () => POLL_S } = declared;
  /** @type {PagedList<any>} */
  const list = new PagedList(path, { filters: [...filters, 'sort', 'descending'], signal });
  parts.table.fill({ caption, columns, keyOf, list, usual });
  parts.pager.fill(list);
  if (parts.text) parts.text.value = list.filters.search ?? list.filters.text;
  if (filters.includes('search')) {
    page.listen(parts.text, 'input', () => orToast(() => list.want({ search: parts.text.value })));
  }
  followFilters(page, list, signal, orToast);
  const menu = page.querySelector('.export-all');
  if (menu) closesElsewhere(menu, signal);
  page.listen(list, 'change', () => {
    const { [rows]: items, total, pending = 0 } = list.value;
    parts.table.show(items);
    parts.table.hidden = total === 0;
    parts.nothing.hidden = total > 0;
    render(parts.pending, pendingNote(pending));
    if (chosen) render(parts.chips, filterChips(chosen(list.filters).filter(([, , value]) => value)));
    show?.(list.value, list);
  });
  list.follow(pauseAfter, (error) => showFault(parts.fault, error));
  return list;
}

/** Widens the list to everything; the fields that narrow it are emptied. */
export function clearFilters({ parts }, list, names) {
  for (const name of names) if (parts[name]) parts[name].value = '';
  orToast(() => list.want(Object.fromEntries(names.map((name) => [name, '']))));
  parts.text.focus();
}

/**
 * The keys of a list: to its search, from page to page, and the help.
 * @returns {() => void} shows the help
 */
export function bindListKeys({ parts, signal }, title, search, others = []) {
  const turn = (button) => () => parts.pager.querySelector(`[data-part=${button}]`).click();
  const bindings = [
    { keys: ['/'], label: search, run: () => parts.text.focus() },
    { keys: ['n'], label: t('pager.next'), run: turn('next') },
    { keys: ['p'], label: t('pager.previous'), run: turn('previous') },
    ...others,
  ];
  const arrows = { keys: ['ArrowUp', 'ArrowDown'], shown: ['↑', '↓'], label: t('table.rows') };
  const help = () => showKeys([{ title, bindings: [...bindings, arrows] }], { hasStage: false });
  bindKeys(document, [...bindings, { keys: ['?'], label: t('keys.list'), run: help }], signal);
  return help;
}
