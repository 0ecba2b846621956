/**
 * Repairs that need no more than a click; each is one step to undo. No check is about the order of observations, which
 * is that of their places; only the two ends of a stretch can stand the wrong way round.
 */

import { t } from '../../../core/page/words.js';
import { finishStretch, swapEnds } from '../actions/stretches.js';

/**
 * Returns what a person may do at once about an issue: [{name, run}].
 * @param {Api['IssueOut']} issue
 * @param {Desk} desk
 */
export function repairsOf({ code, params }, desk) {
  if (code === 'no_start' || code === 'no_finish') {
    return /** @type {string} */ (params.needed).split('/').map((needed) => ({
      name: t('checks.add_here', { code: needed }),
      run: () => addHere(desk, needed),
    }));
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

/** Tags the place of the camera; the kind is asked for in the form, as nobody but the inspector knows it. */
function addHere(desk, code) {
  const made = desk.tag({ code });
  if (!made) return;
  desk.editing.set(true);
  desk.done(t('checks.added', { code }));
}
