/** What a dry run says of each film, as columns of a table, and in one sentence. */

import { html } from '../../../core/page/html.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** Key of the folder that was looked through last. */
export const REMEMBERED_FOLDER = 'chainage.archive-folder';

const orDash = (value) => html`${value ?? html`<span class="dim">–</span>`}`;

export const additionColumns = () => [
  {
    name: 'path',
    title: t('add.path'),
    cell: ({ path, name }) => html`${name && html`<b>${name}</b>`}<small>${path}</small>`,
  },
  { name: 'rule', title: t('add.rule'), cell: ({ rule }) => orDash(rule) },
  { name: 'rig', title: t('archive.rig'), cell: ({ rig_name: rig }) => orDash(rig) },
  { name: 'project', title: t('archive.project'), cell: ({ project }) => orDash(project) },
  { name: 'asset', title: t('archive.asset'), cell: ({ asset }) => orDash(asset) },
  {
    name: 'problem',
    title: t('add.problem'),
    cell: ({ problem }) =>
      problem
        ? html`<span class="additions__problem">${icon('alert')}<span>${problem}</span></span>`
        : html`<span class="additions__fine">${icon('check')}${t('add.fine')}</span>`,
  },
];

/** '12 films: 10 new, 2 in the archive already; 1 without a rig.' and the warnings of the server. */
export function additionSummary({ found, new: added, known, films, warnings = [] }) {
  const bare = films.filter(({ rig_name: rig, name }) => rig === null && name !== null).length;
  return html`<p><b>${t('add.summary', { n: found, found: count(found), added: count(added), known: count(known) })}</b>
      ${bare > 0 && t('add.without_rig', { n: bare, count: count(bare) })}</p>
    ${warnings.map((text) => html`<p class="message message--warning">${icon('alert')}<span>${text}</span></p>`)}`;
}
