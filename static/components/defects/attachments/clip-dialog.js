/** The seconds of film around a defect, cut by the server, to be looked at and sent. */

import { blob, refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { errorText, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/**
 * @param {string} inspection
 * @param {object} item the observation
 * @param {string} title
 */
export async function openClip(inspection, item, title) {
  const { dialog, parts } = openDialog({
    title: t('attach.clip_of', { name: title }),
    size: 'wide',
    content: html`<div class="photos stack gap-3" data-part="clip"><p role="status">${t('attach.cutting')}</p>
      <progress class="bar" aria-label="${t('attach.cutting')}"></progress></div>`,
  });
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  try {
    const clip = await blob(
      `/api/inspections/${inspection}/observations/${item.id}/clip?frame=${item.frame}`,
      end.signal,
    );
    const address = URL.createObjectURL(clip);
    end.signal.addEventListener('abort', () => URL.revokeObjectURL(address));
    render(
      parts.clip,
      html`<video class="clip" src="${address}" controls muted loop autoplay aria-label="${t('attach.clip_of', { name: title })}"></video>
      <p><a class="button button--small" href="${address}" download="${title}.mp4">${icon('download')}${t('attach.clip_save')}</a></p>`,
    );
  } catch (error) {
    if (!refusalIn(error)) return;
    render(
      parts.clip,
      html`<p class="message message--error" role="alert">${icon('alert')}<span>${errorText(error)}</span></p>`,
    );
  }
}
