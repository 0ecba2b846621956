/** A list of assets, inspected or only registered: the table of all, or of those of a project. */

import { html, render } from '../../../core/page/html.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { day } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { likeButton, pendingNote, showFault } from '../archive-shell/archive-shell.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import '../../shared/pager/pager.js';
import { worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { followThumbnails, thumbnail } from '../../shared/thumbnail/thumbnail.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 10;
const USUAL = { sort: 'asset', descending: 'false' };

/** The page of an asset. */
export const assetPath = (asset) => `/archive/assets?${new URLSearchParams({ asset })}`;

/** Says that the same asset probably has another id too. */
export const alsoWritten = (others) =>
  html`${others.length > 0 && html`<span class="chip asset__clash" title="${t('assets.clash_help')}">${icon('alert')}${t('assets.clash', { others: others.join(', ') })}</span>`}`;

export const assetTableMarkup =
  () => html`<search class="row gap-3 wrap below-4"><div class="field find__text"><label class="visually-hidden" for="assets-text">${t('assets.search')}</label>
    <input class="input" id="assets-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('assets.search')}" data-part="text" /></div>
    <span class="find__filters" data-part="chips"></span></search>
  <div data-part="pending"></div>
  <data-table class="assets-table" data-part="table"></data-table>
  <p class="panel find__nothing row gap-3 wrap pad-4" data-part="nothing" hidden>${t('assets.nothing')}</p>
  <list-pager data-part="pager"></list-pager>`;

/**
 * Fills the table, and keeps it up to date.
 * @param {import('../../../core/page/store.js').Component} page has the parts of the markup, and `fault`
 * @param {boolean} isOfProject whether the address names the project, which then needs no column
 * @returns {PagedList<Api['AssetsOut']>}
 */
export function fillAssetTable(page, isOfProject) {
  const { parts, signal } = page;
  /** @type {PagedList<Api['AssetsOut']>} */
  const list = new PagedList('/api/archive/assets', {
    filters: ['search', 'project', 'no_project', 'sort', 'descending'],
    signal,
  });
  parts.text.value = list.filters.search;
  const columns = allColumns().filter(({ name }) => name !== 'project' || !isOfProject);
  parts.table.fill({ caption: t('archive.assets'), columns, keyOf: ({ asset }) => asset, list, usual: USUAL });
  parts.pager.fill(list);
  followThumbnails(parts.table, signal);
  page.listen(parts.text, 'input', () => orToast(() => list.want({ search: parts.text.value })));
  page.listen(list, 'change', () => {
    const { assets, total, pending } = list.value;
    parts.table.show(assets);
    parts.table.hidden = total === 0;
    parts.nothing.hidden = total > 0;
    render(parts.pending, pendingNote(pending));
  });
  list.follow(
    () => POLL_S,
    (error) => showFault(parts.fault, error),
  );
  return list;
}

const allColumns = () => [
  {
    name: 'picture',
    title: html`<span class="visually-hidden">${t('assets.picture')}</span>`,
    cell: ({ filmed_id: id }) => thumbnail(id),
  },
  {
    name: 'asset',
    title: t('archive.asset'),
    sort: 'asset',
    cell: ({ asset, also_written: others }) => html`<a href="${assetPath(asset)}">${asset}</a> ${alsoWritten(others)}`,
  },
  {
    name: 'project',
    title: t('archive.project'),
    sort: 'project',
    cell: ({ project }) => likeButton('project', project),
  },
  {
    name: 'inspections',
    title: t('assets.inspections'),
    sort: 'inspections',
    descends: true,
    cell: ({ asset, inspections: n }) =>
      n
        ? html`<a class="number" href="/?${new URLSearchParams({ asset })}">${n}</a>`
        : html`<span class="dim">${t('assets.never_short')}</span>`,
  },
  {
    name: 'last',
    title: t('assets.last'),
    sort: 'last_on',
    descends: true,
    cell: ({ last_at: at }) => html`<span class="number">${at ? day(at) : '–'}</span>`,
  },
  {
    name: 'worst',
    title: t('list.worst'),
    sort: 'worst_severity',
    descends: true,
    cell: ({ worst_severity: worst }) => worstMarkup(worst),
  },
];
