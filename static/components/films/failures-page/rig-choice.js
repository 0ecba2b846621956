/** Another rig for all films of a group: one of the rules, or a new one. */

import { html } from '../../../core/page/html.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { formFoot, openDialog } from '../../shared/dialog/dialog.js';
import '../../intake/rig-form/rig-form.js';

/**
 * @param {number} n films
 * @param {Record<string, object>} rigs those of the rules
 * @returns {Promise<{rig_name: string}|{rig: object}|null>} null: it was dismissed
 */
export async function askOtherRig(n, rigs) {
  const names = Object.keys(rigs);
  const { dialog, parts, closed } = openDialog({
    title: t('failures.rig_title', { n, count: count(n) }),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="other-rig">${t('archive.rig')}</label>
        <select class="input" id="other-rig" data-part="choice">
          ${names.map((name) => html`<option value="${name}">${name}</option>`)}
          <option value="">${t('failures.rig_new')}</option></select>
        <span class="help">${t('failures.rig_help')}</span></div>
      <rig-form data-part="rig" ${names.length > 0 && 'hidden'}></rig-form>
      ${formFoot(t('failures.rig_submit'))}</form>`,
    size: 'wide',
  });
  parts.choice.focus();
  parts.choice.addEventListener('change', () => (parts.rig.hidden = parts.choice.value !== ''));
  let chosen = null;
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    const name = parts.choice.value;
    if (name === '' && !parts.rig.check()) return;
    chosen = name ? { rig_name: name } : { rig: parts.rig.value };
    dialog.close();
  });
  await closed;
  return chosen;
}
