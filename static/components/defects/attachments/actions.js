/** Commands about what is attached to a defect, for buttons and keys. */

import { mayEdit } from '../../../core/page/rights.js';
import { whyLocked } from '../../../core/defects/review.js';
import { t } from '../../../core/page/words.js';
import { nameOf } from '../defect-list/names.js';

/**
 * Adds a photo of the shown frame to an observation, by default the selected one.
 * @param {import('../../desk/page/desk.js').Desk} desk
 */
export function addPhoto(desk, id = desk.selection.value) {
  const item = id && desk.observations.find(id);
  const { frame, row } = desk.playhead.value;
  if (!mayEdit()) desk.fault(whyLocked());
  else if (!item) desk.fault(t('attach.select_first'));
  else if (!row) desk.fault(t('desk.not_tracked'));
  else {
    desk.attachments.add(item, { kind: 'photo', frame });
    desk.done(t('attach.photo_added', { name: nameOf(item) }));
  }
}

/** Deletes an attachment of an observation, which can be undone. */
export function detach(desk, item, attachment) {
  desk.attachments.remove(item, attachment);
  desk.done(t('attach.deleted'));
}
