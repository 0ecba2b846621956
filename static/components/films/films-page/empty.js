/** What an archive is and how it begins, for whoever has none yet. */

import { html } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { pieces, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const SETTING = 'CHAINAGE_ARCHIVE_FOLDERS';
const COMMAND = 'chainage archive add /films --rules rules.json';

export const emptyArchive = () => html`<h2>${t('archive.empty')}</h2>
  <p>${t('archive.empty_text')}</p>
  <ol class="steps stack">
    <li>${pieces('archive.empty_rules', { rules: html`<a href="/films/rules">${t('archive.rules')}</a>` })}</li>
    <li>${pieces('archive.empty_folder', { setting: html`<code>${SETTING}</code>` })}</li>
    <li>${t('archive.empty_add')}</li>
    <li>${t('archive.empty_start')}</li>
  </ol>
  ${may('admin') && html`<a class="button button--primary" href="/films/add">${icon('plus')}${t('archive.add')}</a>`}
  <p class="dim">${t('archive.empty_command')}</p>
  <pre class="command framed pad-3" tabindex="0"><code>${COMMAND}</code></pre>`;
