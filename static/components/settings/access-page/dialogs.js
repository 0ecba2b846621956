/** Dialogs about the access of a colleague: make one, show its link once, end one. */

import { post } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { ROLES } from '../../../core/page/rights.js';
import { t, wordFor } from '../../../core/page/words.js';
import { ask, closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/**
 * Makes an access and shows its link, which the server keeps nowhere.
 * @returns {Promise<boolean>} whether one was made
 */
export async function makeToken() {
  const opened = openDialog({
    title: t('users.add'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="token-name">${t('users.name')}</label>
        <input class="input" id="token-name" maxlength="100" autocomplete="off" aria-describedby="token-help" data-part="name" />
        <span class="help" id="token-help">${t('users.name_help')}</span></div>
      <fieldset class="users__roles stack gap-1"><legend class="label">${t('users.role')}</legend>
        ${ROLES.map(
          (
            role,
          ) => html`<label class="switch row"><input type="radio" name="role" value="${role}" ${role === 'operator' && 'checked'} />
          <span><b>${wordFor('role', role)}</b> <span class="dim">${wordFor('role_help', role)}</span></span></label>`,
        )}</fieldset>
      ${formFoot(t('users.create'))}</form>`,
  });
  const { parts, closed } = opened;
  parts.name.focus();
  let made = null;
  closesWhenSent(opened, async () => {
    const name = parts.name.value.trim();
    made = { name, ...(await post('/api/tokens', { name, role: new FormData(parts.form).get('role') })) };
  });
  await closed;
  if (made) await showSecret(made);
  return made !== null;
}

async function showSecret({ name, secret }) {
  const { parts, closed } = openDialog({
    title: t('users.secret_title', { name }),
    content: html`<form method="dialog" class="stack gap-4">
      <p class="message message--warning">${icon('alert')}<span>${t('users.secret_text')}</span></p>
      <div class="field"><label for="token-secret">${t('users.secret')}</label>
        <input class="input mono" id="token-secret" readonly value="${linkOf(secret)}" data-part="secret" /></div>
      <p class="dim" role="status" data-part="note"></p>
      <div class="dialog__buttons"><button type="button" class="button button--primary" data-part="copy">${icon('link')}${t('users.copy')}</button>
        <button class="button">${t('page.close')}</button></div></form>`,
  });
  parts.secret.select();
  parts.copy.focus();
  parts.copy.addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(secret);
      parts.note.textContent = t('users.copied');
    } catch {
      // refused, or over plain http, where there is no clipboard
      parts.secret.select();
      parts.note.textContent = t('users.not_copied');
    }
  });
  await closed;
}

/** The address that logs in with an access; the server takes the secret out of it at once. */
const linkOf = (secret) => `${location.origin}/login?${new URLSearchParams({ token: secret })}`;

/** Asks whether an access ends; it cannot be undone. */
export const askRevoke = (name) =>
  ask({ title: t('users.revoke_title', { name }), text: t('users.revoke_text', { name }), submit: t('users.revoke') });
