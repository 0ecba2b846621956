/** Asks before an inspection is coded with another pack or version, and lists what would no longer fit. */

import { get } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { sentenceOf } from '../panels/sentences.js';

/**
 * @param {import('../page/desk.js').Desk} desk
 * @param {string|null} pack id of the other one; null: the built-in one
 * @param {string} name of the other one
 * @returns {Promise<boolean>} whether to go ahead
 */
export async function askMove({ inspection, observations }, pack, name) {
  const query = pack === null ? '' : `?pack=${pack}`;
  const { checks } = await get(`/api/inspections/${inspection.id}/checks/with-pack${query}`);
  const { parts, closed } = openDialog({
    title: t('settings.pack_move_title', { name }),
    content: html`<form method="dialog" class="stack gap-4">
      <p>${checks.length ? t('settings.pack_move_lost', { n: checks.length }) : t('settings.pack_move_fits')}</p>
      ${
        checks.length > 0 &&
        html`<ul class="stack" tabindex="0" aria-label="${t('settings.pack_move_lost', { n: checks.length })}">${checks.map(
          (issue) => html`<li>${sentenceOf(issue, observations.find(issue.observation_id) ?? null)}</li>`,
        )}</ul>`
      }
      <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
        <button class="button ${checks.length ? 'button--danger' : 'button--primary'}" value="yes">${t('settings.pack_move')}</button></div></form>`,
  });
  parts.cancel.focus();
  return (await closed) === 'yes';
}
