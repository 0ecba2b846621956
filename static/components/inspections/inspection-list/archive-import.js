/** Brings an inspection from another server: sends its archive file, which may be as large as a film. */

import { ApiError, post } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { Upload } from '../../../core/server/upload.js';
import { bytes } from '../../../core/wall/units.js';
import { errorText, language, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';

const isBeingSent = ({ state }) => state === 'SENDING' || state === 'WAITING';
const stop = () => ({
  title: t('list.archive_stop_title'),
  text: t('list.archive_stop_text'),
  submit: t('list.archive_stop'),
});

/**
 * Shows how far the file is; a file that was begun before is sent on. What the server has begun to store it ends,
 * all of it or nothing, whether or not the dialog is still there.
 * @param {File} file
 * @returns {Promise<object|null>} what the server has imported; null: it was cancelled, or refused and said so
 */
export async function importArchive(file) {
  const upload = new Upload(file, file.name);
  const { dialog, parts, closed } = openDialog({
    title: t('list.archive_title', { filename: file.name }),
    content: html`<div class="stack gap-4">
      <p role="status" data-part="said"></p>
      <progress class="bar" max="1" aria-label="${t('list.archive_progress')}" data-part="bar"></progress>
      <p class="fault" role="alert" data-part="fault"></p>
      <div class="dialog__buttons">
        <button type="button" class="button" data-part="again" hidden>${t('list.archive_again')}</button>
        <button type="button" class="button button--primary" data-part="cancel">${t('page.cancel')}</button></div></div>`,
    question: () => (isBeingSent(upload) ? stop() : null),
  });
  let imported = null;
  /** What the server stores at present. @type {Promise<unknown>|null} */
  let storing = null;

  const show = () => {
    parts.bar.value = upload.size ? upload.offset / upload.size : 0;
    const sent = { percent: Math.floor(100 * parts.bar.value), size: bytes(upload.size) };
    parts.said.textContent = upload.state === 'WAITING' ? upload.reason : t('list.archive_sending', sent);
  };
  const store = async () => {
    parts.bar.removeAttribute('value');
    parts.said.textContent = t('list.archive_storing');
    parts.cancel.disabled = true;
    storing = post(`/api/imports/archive?lang=${language}`, { upload_id: upload.id });
    try {
      imported = await storing;
      upload.forget();
    } finally {
      storing = null;
      parts.cancel.disabled = false;
    }
  };
  const run = async () => {
    parts.fault.textContent = '';
    parts.again.hidden = true;
    try {
      await upload.start();
      if (upload.state === 'CANCELLED') return;
      if (upload.state !== 'DONE') throw new ApiError(0, 'upload_failed', upload.reason ?? '');
      await store();
      dialog.close();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      parts.bar.value = 0;
      parts.said.textContent = '';
      parts.fault.textContent = upload.reason ?? errorText(error);
      parts.again.hidden = false;
      parts.again.focus();
    }
  };

  upload.addEventListener('change', show);
  parts.again.addEventListener('click', run);
  parts.cancel.focus();
  run();
  await closed;
  await storing?.catch(toastError);
  if (!imported) upload.cancel().catch(toastError);
  return imported;
}
