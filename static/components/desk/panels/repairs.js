/**
 * Repairs that need no more than a click; each is one step to undo. What stands out of order is moved by hand; only the
 * two ends of a stretch can be swapped.
 */

import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { codesOf, confirmEnd, endOf } from '../actions/ends.js';
import { finishStretch, swapEnds } from '../actions/stretches.js';
import { openRig } from '../dialogs/run-again.js';
import { FIELD_OF } from '../../intake/new-inspection/pipe.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

/**
 * Returns what a person may do at once about an issue: [{name, run}].
 * @param {Api['IssueOut']} issue
 * @param {Desk} desk
 */
export function repairsOf(issue, desk) {
  const { code, params } = issue;
  if ((code === 'no_start' || code === 'no_finish') && 'frame' in params) {
    return codesOf(issue)
      .map((needed) => endOf(desk, issue, needed))
      .map((end) => ({
        name: t('checks.add_at', { code: end.code, where: chainage(end.distance_m) }),
        run: () => addEnd(desk, end),
      }));
  }
  if (code === 'rig_pipe_differs') {
    const path = Object.keys(FIELD_OF).find((name) => FIELD_OF[name] === params.field);
    const again = async () =>
      (await openRig(desk, { changes: { [path]: Number(params.header_mm) } })) && location.reload();
    return [{ name: t('checks.track_again', { mm: params.header_mm }), run: () => orToast(again) }];
  }
  // The checks may know a stretch that the list of the page has not read yet.
  const isRead = (role) => desk.observations.value.some(({ continuous }) => continuous === `${role}${params.stretch}`);
  if (code === 'stretch_falls' && isRead('A') && isRead('B')) {
    return [{ name: t('checks.swap'), run: () => swapEnds(desk, params.stretch) }];
  }
  if (code === 'open_stretch' && isRead('A')) {
    return [{ name: t('checks.finish_here'), run: () => finishStretch(desk, params.stretch) }];
  }
  return [];
}

/** Adds a start or an end, and opens its form: its kind is a guess. */
function addEnd(desk, end) {
  const made = confirmEnd(desk, end);
  if (!made) return;
  desk.goTo(made.id);
  desk.editing.set(true);
  desk.done(t('checks.added', { code: end.code }));
}
