/** A rig with its name, in a dialog. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { formFoot, openDialog } from '../../shared/dialog/dialog.js';
import '../../intake/rig-form/rig-form.js';

/**
 * Asks for a rig and its name; null: it was dismissed.
 * @param {string|null} name of the rig that is edited, null: a new one
 * @param {Record<string, object>} rigs
 * @returns {Promise<{name: string, rig: object}|null>}
 */
export async function askRig(name, rigs) {
  const { dialog, parts, closed } = openDialog({
    title: name === null ? t('rules.add_rig') : t('rules.edit_named', { name }),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="rig-name">${t('rules.name')}</label>
        <input class="input" id="rig-name" maxlength="200" autocomplete="off" aria-describedby="rig-name-fault" data-part="name" value="${name ?? ''}" />
        <span class="fault" id="rig-name-fault" role="alert" data-part="said"></span></div>
      <rig-form data-part="rig"></rig-form>
      ${formFoot(t('rules.rig_take'))}</form>`,
    size: 'wide',
  });
  if (name !== null) parts.rig.value = rigs[name];
  parts.name.focus();
  let taken = null;
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    const wanted = parts.name.value.trim();
    const isTaken = wanted !== name && wanted in rigs;
    parts.said.textContent = wanted === '' ? t('page.needed') : isTaken ? t('rules.name_taken') : '';
    parts.name.setAttribute('aria-invalid', String(parts.said.textContent !== ''));
    if (parts.said.textContent) parts.name.focus();
    else if (parts.rig.check()) {
      taken = { name: wanted, rig: parts.rig.value };
      dialog.close();
    }
  });
  await closed;
  return taken;
}
