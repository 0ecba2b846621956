/** The state of saving in a few words: what waits for the server, what waits for a decision. */

import { listenTo } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

/**
 * Follows what this browser has not saved yet.
 * @param {HTMLElement} place
 * @param {Desk} desk
 * @param {AbortSignal} signal
 */
export function showSaving(place, { outbox, attachmentOutbox, conflicts }, signal) {
  const boxes = [outbox, attachmentOutbox];
  const show = () => {
    const count = boxes.reduce((sum, box) => sum + box.count, 0);
    const reason = boxes.map((box) => box.reason).find((found) => found !== null) ?? null;
    const isStuck = reason !== null && count > 0;
    const { length: undecided } = conflicts.value;
    const settled = undecided ? t('desk.undecided', { n: undecided }) : t('desk.saved');
    place.textContent = count === 0 ? settled : t('desk.waiting', { n: count });
    place.title = isStuck ? reason : '';
    place.classList.toggle('save--waiting', count + undecided > 0);
  };
  listenTo([...boxes, conflicts], 'change', signal, show);
  show();
}
