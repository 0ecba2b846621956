/** A list of assets, inspected or only registered: the table of all, or of those of a project. */

import { html } from '../../../core/page/html.js';
import { day } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { likeButton } from '../../shared/page-frame/page-frame.js';
import { followList, searchMarkup, tableMarkup } from '../../shared/page-frame/list-page.js';
import { column, figures } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { followThumbnails, thumbnail } from '../../shared/thumbnail/thumbnail.js';

/** The page of an asset. */
export const assetPath = (asset) => `/assets?${new URLSearchParams({ asset })}`;

/** Says that the same asset probably has another id too. */
export const alsoWritten = (others) =>
  html`${others.length > 0 && html`<span class="chip asset__clash sign-weak" title="${t('assets.clash_help')}">${icon('alert')}${t('assets.clash', { others: others.join(', ') })}</span>`}`;

export const assetTableMarkup = () =>
  html`${searchMarkup(t('assets.search'))}${tableMarkup('assets-table', t('assets.nothing'))}`;

/**
 * Fills the table, and keeps it up to date.
 * @param {import('../../../core/page/store.js').Component} page has the parts of the markup, and `fault`
 * @param {boolean} isOfProject whether the address names the project, which then needs no column and no chip
 */
export function fillAssetTable(page, isOfProject) {
  followThumbnails(page.parts.table, page.signal);
  followList(page, {
    path: '/api/archive/assets',
    filters: ['search', 'project', 'no_project'],
    rows: 'assets',
    caption: t('archive.assets'),
    columns: allColumns().filter(({ name }) => name !== 'project' || !isOfProject),
    keyOf: ({ asset }) => asset,
    usual: { sort: 'asset', descending: 'false' },
    chosen: ({ project }) => (isOfProject ? [] : [['project', t('archive.project'), project]]),
  });
}

const allColumns = () => [
  column(
    'picture',
    html`<span class="visually-hidden">${t('assets.picture')}</span>`,
    ({ filmed_id: id }) => thumbnail(id),
    undefined,
    '104px',
  ),
  column(
    'asset',
    t('archive.asset'),
    ({ asset, also_written: others }) => html`<a href="${assetPath(asset)}">${asset}</a> ${alsoWritten(others)}`,
    'asset',
  ),
  column('project', t('archive.project'), ({ project }) => likeButton('project', project), 'project'),
  figures('inspections', t('assets.inspections'), ({ asset, inspections: n }) =>
    n
      ? html`<a class="number" href="/inspections?${new URLSearchParams({ asset })}">${n}</a>`
      : html`<span class="dim">${t('assets.never_short')}</span>`,
  ),
  figures('last', t('assets.last'), ({ last_at: at }) => at && day(at), 'last_on'),
  figures('worst', t('list.worst'), ({ worst_severity: worst }) => worstMarkup(worst), 'worst_severity'),
];
