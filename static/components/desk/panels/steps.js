/** Asks before the review of an inspection moves on: what the step means, and why it is taken. */

import { html } from '../../../core/page/html.js';
import { t, wordFor } from '../../../core/page/words.js';
import { formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { message } from '../../shared/message/message.js';

/**
 * @param {string} state the next one
 * @param {number} blocking issues that stand against the report
 * @returns {Promise<{reason: string|null}|null>} null when the person has thought better of it
 */
export async function askStep(state, blocking) {
  const isNeeded = state === 'reopened';
  const { dialog, parts, closed } = openDialog({
    title: wordFor('review_step', state),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <p>${wordFor('review_step_text', state)}</p>
      ${blocking > 0 && message('warning', t('reviewing.blocking', { n: blocking }))}
      <div class="field"><label for="review-reason">${isNeeded ? t('reviewing.reason') : t('reviewing.note')}</label>
        <textarea class="input" id="review-reason" rows="3" maxlength="2000" aria-describedby="review-fault" data-part="reason"></textarea>
        <span class="fault" id="review-fault" data-part="reasonFault"></span></div>
      ${formFoot(wordFor('review_step', state))}</form>`,
  });
  parts.reason.focus();
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    const isMissing = isNeeded && !parts.reason.value.trim();
    parts.reasonFault.textContent = isMissing ? t('reviewing.reason_needed') : '';
    parts.reason.setAttribute('aria-invalid', String(isMissing));
    if (!isMissing) dialog.close('yes');
  });
  return (await closed) === 'yes' ? { reason: parts.reason.value.trim() || null } : null;
}
