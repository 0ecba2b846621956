/** Shows an address with a secret in it, which the server keeps nowhere, and copies it. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';
import { openDialog } from './dialog.js';

/** @param {{title: string, text: string, label: string, address: string, copied?: string}} what copied: if not the address */
export async function showOnce({ title, text, label, address, copied = address }) {
  const { parts, closed } = openDialog({
    title,
    content: html`<form method="dialog" class="stack gap-4">
      <p class="message message--warning">${icon('alert')}<span>${text}</span></p>
      <div class="field"><label for="shown-once">${label}</label>
        <input class="input mono" id="shown-once" readonly value="${address}" data-part="secret" /></div>
      <p class="dim" role="status" data-part="note"></p>
      <div class="dialog__buttons"><button type="button" class="button button--primary" data-part="copy">${icon('link')}${t('users.copy')}</button>
        <button class="button">${t('page.close')}</button></div></form>`,
  });
  parts.secret.select();
  parts.copy.focus();
  parts.copy.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(copied);
      parts.note.textContent = t('users.copied');
    } catch {
      // refused, or over plain http, where there is no clipboard
      parts.secret.select();
      parts.note.textContent = t('users.not_copied');
    }
  });
  await closed;
}
