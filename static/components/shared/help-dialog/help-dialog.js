/** Short help in the order of the work. */

import { html } from '../../../core/page/html.js';
import { isKeyOn } from '../../../core/page/keys.js';
import { pieces, t } from '../../../core/page/words.js';
import { openDialog } from '../dialog/dialog.js';

export const showHelp = () =>
  openDialog({
    title: t('help.title'),
    content: html`<p>${t('help.intro')}</p>
      <dl class="help-steps">
        <dt>${t('help.drive')}</dt><dd>${t('help.drive_text')}</dd>
        <dt>${t('help.tag')}</dt><dd>${t('help.tag_text')}</dd>
        <dt>${t('help.trust')}</dt><dd>${t('help.trust_text')}</dd>
        <dt>${t('help.correct')}</dt><dd>${t('help.correct_text')}</dd>
        <dt>${t('help.take')}</dt><dd>${t('help.take_text')}</dd>
      </dl>
      <p class="dim">${pieces('help.keys', { key: isKeyOn('?') ? html`<kbd>?</kbd>` : t('keys.title') })}</p>`,
  });
