/** Dialogs about the access of a colleague: make one, show its link once, end one. */

import { get, post } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { ROLES } from '../../../core/page/rights.js';
import { t, wordFor } from '../../../core/page/words.js';
import { ask, closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { showOnce } from '../../shared/dialog/show-once.js';

/**
 * Makes an access and shows its link, which the server keeps nowhere.
 * @returns {Promise<boolean>} whether one was made
 */
export async function makeToken() {
  const { projects } = await get('/api/archive/projects?limit=500');
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
      <fieldset class="users__roles stack gap-1" aria-describedby="token-projects"><legend class="label">${t('users.projects')}</legend>
        <span class="help" id="token-projects">${t('users.projects_help')}</span>
        <div class="users__projects stack gap-1">${projects
          .filter(({ project }) => project !== null)
          .map(
            ({ project }) =>
              html`<label class="switch row"><input type="checkbox" name="project" value="${project}" /><span>${project}</span></label>`,
          )}</div></fieldset>
      ${formFoot(t('users.create'))}</form>`,
  });
  const { parts, closed } = opened;
  parts.name.focus();
  let made = null;
  closesWhenSent(opened, async () => {
    const name = parts.name.value.trim();
    const chosen = new FormData(parts.form);
    const only = chosen.getAll('project');
    const wanted = { name, role: chosen.get('role'), projects: only.length ? only : null };
    made = { name, ...(await post('/api/tokens', wanted)) };
  });
  await closed;
  if (made) await showSecret(made);
  return made !== null;
}

const showSecret = ({ name, secret }) =>
  showOnce({
    title: t('users.secret_title', { name }),
    text: t('users.secret_text'),
    label: t('users.secret'),
    address: linkOf(secret),
    copied: secret,
  });

/** The address that logs in with an access; the server takes the secret out of it at once. */
const linkOf = (secret) => `${location.origin}/login?${new URLSearchParams({ token: secret })}`;

/** Asks whether an access ends; it cannot be undone. */
export const askRevoke = (name) =>
  ask({ title: t('users.revoke_title', { name }), text: t('users.revoke_text', { name }), submit: t('users.revoke') });
