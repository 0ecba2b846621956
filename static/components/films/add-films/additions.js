/** What a dry run says of each film, as columns of a table, and in one sentence. */

import { html } from '../../../core/page/html.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { column, orDash } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';

export const additionColumns = () => [
  column(
    'path',
    t('add.path'),
    ({ path, name }) => html`${name && html`<b>${name}</b>`}<small>${path}</small>`,
    undefined,
    '34%',
  ),
  column('rule', t('add.rule'), ({ rule }) => orDash(rule)),
  column('rig', t('archive.rig'), ({ rig_name: rig }) => orDash(rig)),
  column('project', t('archive.project'), ({ project }) => orDash(project)),
  column('asset', t('archive.asset'), ({ asset }) => orDash(asset)),
  column(
    'problem',
    t('add.problem'),
    ({ problem }) =>
      problem
        ? html`<span class="row at-top sign-weak">${icon('alert')}<span>${problem}</span></span>`
        : html`<span class="row at-top sign-ok">${icon('check')}${t('add.fine')}</span>`,
    undefined,
    '26%',
  ),
];

/** '12 films: 10 new, 2 in the archive already; 1 without a rig.' and the warnings of the server. */
export function additionSummary({ found, new: added, known, films, warnings = [] }) {
  const bare = films.filter(({ rig_name: rig, name }) => rig === null && name !== null).length;
  return html`<p><b>${t('add.summary', { n: found, found: count(found), added: count(added), known: count(known) })}</b>
      ${bare > 0 && t('add.without_rig', { n: bare, count: count(bare) })}</p>
    ${warnings.map((text) => message('warning', text))}`;
}
