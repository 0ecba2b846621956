/** What is written on the film: at the pointer, and in place of a picture that is not there. */

import { hasFilm } from '../../../core/survey/inspection.js';
import { chainage, clockHour } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/**
 * Returns what a click would do, or the place of the wall that the pointer is on.
 * @param {Desk} desk
 * @param {[number, number]} pixel
 * @param {object|null} mark the one under the pointer
 */
export function atPointer({ wall, playhead, picking }, pixel, mark) {
  if (picking.value) return t('corrections.mark_here');
  if (mark) return t('video.select', { what: mark.code || t('video.tag') });
  const point = wall?.at(...pixel, playhead.value.row);
  if (!point) return t('video.no_wall');
  const clock = point.clock_h === null ? '' : ` · ${clockHour(point.clock_h)}`;
  return `${chainage(point.distance_m)}${clock}`;
}

/** Returns why there is no picture yet, '' where that needs no words. */
export function whyNoPicture({ inspection, track }) {
  const { status } = inspection.value;
  if (!hasFilm(inspection.value)) return t('video.note_no_film');
  if (track.length && status !== 'running') return t('video.note_loading');
  return {
    queued: t('video.note_queued'),
    running: t('video.note_running'),
    done: '',
    failed: t('video.note_failed'),
    cancelled: t('video.note_cancelled'),
  }[status];
}
