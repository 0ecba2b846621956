/** Repairs that need no more than a click, at the shown frame; each is one step to undo. */

import { t } from '../../core/words.js';
import { finishStretch } from '../inspection-page/stretches.js';

/**
 * Returns what a person may do at once about an issue: [{name, run}].
 * @param {import('../../core/checks.js').Issue} issue
 * @param {import('../inspection-page/desk.js').Desk} desk
 */
export function repairsOf({ code, params }, desk) {
  if (code === 'no_start' || code === 'no_finish') {
    return params.needed.split(' or ').map((needed) => ({
      name: t('checks.add_here', { code: needed }),
      run: () => addHere(desk, needed),
    }));
  }
  if (code !== 'open_stretch') return [];
  return [{ name: t('checks.finish_here'), run: () => finishStretch(desk, params.stretch) }];
}

/** Tags the place of the camera; the kind is asked for in the form, as nobody but the inspector knows it. */
function addHere(desk, code) {
  const made = desk.tag({ code });
  if (!made) return;
  desk.editing.set(true);
  desk.done(t('checks.added', { code }));
}
