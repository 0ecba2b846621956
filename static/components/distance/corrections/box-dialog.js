/** The dialog in which a person draws the box of the counter on the shown frame. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import './counter-box.js';

/**
 * @param {Desk} desk
 * @returns {Promise<import('../../../core/survey/counter.js').Box|null>} null when it was dismissed
 */
export async function askForBox(desk) {
  const { dialog, parts, closed } = openDialog({
    title: t('counter.draw_title'),
    size: 'wide',
    content: html`<counter-box data-part="picture"></counter-box>
      <div class="dialog__buttons">
        <button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
        <button type="button" class="button button--primary" data-part="read">${t('counter.read_box')}</button>
      </div>`,
  });
  const {
    id,
    value: { video },
  } = desk.inspection;
  const frame = Math.max(desk.playhead.value.frame, 0);
  const { picture, read, cancel } = parts;
  picture.draw(
    {
      source: `/api/inspections/${id}/frames/${frame}.jpg`,
      alt: t('corrections.frame', { frame }),
      width: video.width,
      height: video.height,
      pixel_aspect: video.pixel_aspect,
    },
    desk.counter.value?.box ?? null,
  );
  const show = () => (read.disabled = picture.value === null);
  picture.addEventListener('box', show);
  cancel.addEventListener('click', () => dialog.close());
  read.addEventListener('click', () => dialog.close('read'));
  show();
  return (await closed) === 'read' ? picture.value : null;
}
