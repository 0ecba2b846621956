/** Dialogs before films of the archive are changed, stopped or taken off the list. */

import { get } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { ask, formFoot, openDialog } from '../../shared/dialog/dialog.js';

/** Asks whether films may be stopped: what was tracked of them would be begun again. */
export const askCancel = (n) =>
  ask({
    title: t('archive.cancel_title', { n, count: count(n) }),
    text: t('archive.cancel_text'),
    submit: t('archive.cancel_submit'),
  });

/** Asks whether films may be taken off the list: their rig and header in the archive are lost. */
export const askTakeOff = (n) =>
  ask({
    title: t('archive.off_title', { n, count: count(n) }),
    text: t('archive.off_text'),
    submit: t('archive.off_submit'),
  });

/**
 * Asks what to set for some films; returns it, or null. Empty fields stay as they are.
 * @returns {Promise<{rig_name?: string, project?: string, asset?: string, priority?: number}|null>}
 */
export async function askChange(n, signal) {
  const { rigs } = await get('/api/archive/rules', signal);
  const { dialog, parts, closed } = openDialog({
    title: t('archive.change_title', { n, count: count(n) }),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
      <p class="help">${t('archive.change_help')}</p>
      <div class="field"><label for="change-rig">${t('archive.rig')}</label>
        <select class="input" id="change-rig" data-part="rig"><option value="">${t('archive.stays')}</option>
          ${Object.keys(rigs).map((name) => html`<option value="${name}">${name}</option>`)}</select>
        <span class="help">${t('archive.rig_counts')}</span></div>
      ${field('project', t('archive.project'))}${field('asset', t('archive.asset'))}
      <div class="field"><label for="change-priority">${t('archive.priority')}</label>
        <input class="input" id="change-priority" type="number" min="-9" max="9" step="1" inputmode="numeric" data-part="priority" aria-describedby="change-priority-help" />
        <span class="help" id="change-priority-help">${t('archive.priority_help')}</span></div>
      ${formFoot(t('archive.change_submit'))}</form>`,
  });
  parts.rig.focus();
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    if (parts.priority.checkValidity()) return dialog.close('yes');
    parts.fault.textContent = t('archive.priority_help');
    parts.priority.focus();
  });
  if ((await closed) !== 'yes') return null;
  const wanted = {
    rig_name: parts.rig.value,
    project: parts.project.value.trim(),
    asset: parts.asset.value.trim(),
    priority: parts.priority.value === '' ? '' : Number(parts.priority.value),
  };
  const set = Object.fromEntries(Object.entries(wanted).filter(([, value]) => value !== ''));
  return Object.keys(set).length ? set : null;
}

const field = (name, title) => html`<div class="field"><label for="change-${name}">${title}</label>
  <input class="input" id="change-${name}" maxlength="200" autocomplete="off" data-part="${name}" /></div>`;
