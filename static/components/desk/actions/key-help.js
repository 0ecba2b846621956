/** The list of all keys, in a dialog. */

import { html } from '../../../core/page/html.js';
import { isKeyOn, shownKey } from '../../../core/page/keys.js';
import { t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';

/**
 * @param {{title: string, bindings: import('../../../core/page/keys.js').Binding[]}[]} groups
 * @param {{hasStage?: boolean}} [page] hasStage: whether the page has a picture and strips
 */
export const showKeys = (groups, { hasStage = true } = {}) =>
  openDialog({
    title: t('keys.title'),
    size: 'wide',
    content: html`${!isKeyOn('a') && html`<p class="message">${t('keys.singles_off')}</p>`}<div class="key-help">
      ${groups
        .map(withoutOff)
        .filter(({ bindings }) => bindings.length)
        .map(({ title, bindings }) => html`<section><h3>${title}</h3><dl>${bindings.map(row)}</dl></section>`)}
      ${
        hasStage &&
        html`<section><h3>${t('keys.pointer')}</h3><dl>
        <div><dt>${t('keys.picture')}</dt><dd>${t('keys.picture_help')}</dd></div>
        <div><dt>${t('ask.label')}</dt><dd>${t('keys.ask_help')}</dd></div>
        <div><dt>${t('keys.strip')}</dt><dd>${t('keys.strip_help')}</dd></div>
        <div><dt>${t('keys.zoom')}</dt><dd>${t('keys.zoom_help')}</dd></div>
        <div><dt>${t('keys.wall')}</dt><dd>${t('keys.wall_help')}</dd></div>
        <div><dt>${t('keys.view')}</dt><dd>${t('keys.view_help')}</dd></div>
      </dl></section>`
      }
    </div>`,
  });

const withoutOff = ({ title, bindings }) => ({
  title,
  bindings: bindings.filter(({ keys }) => keys.some(isKeyOn)),
});

const row = ({ keys, shown = keys.map(shownKey), label }) =>
  html`<div><dt>${shown.filter(isKeyOn).map((key, i) => html`${i > 0 && t('keys.or')}<kbd>${key}</kbd>`)}</dt><dd>${label}</dd></div>`;
