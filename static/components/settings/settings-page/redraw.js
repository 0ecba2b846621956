/** Draws the page again after a choice that may change every word and number of it. */

import { ApiError } from '../../../core/server/api.js';
import { preferences } from '../../../core/page/preferences.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';

/** Key in the session storage: the choice that has the focus again on the redrawn page. */
const CHOSEN = 'chainage.settings';

/**
 * Saves a choice and redraws the page with it.
 * @param {Partial<import('../../../core/page/preferences.js').Chosen>} changes
 * @param {'language'|'units'} [choice] gets the focus on the redrawn page
 */
export async function redrawWith(changes, choice) {
  try {
    await preferences.save(changes);
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    toastError(error);
    return;
  }
  if (choice) sessionStorage.setItem(CHOSEN, choice);
  location.reload();
}

/** Returns the choice with which the page was redrawn, once. @returns {'language'|'units'|null} */
export function choiceOfRedraw() {
  const choice = /** @type {'language'|'units'|null} */ (sessionStorage.getItem(CHOSEN));
  sessionStorage.removeItem(CHOSEN);
  return choice;
}
