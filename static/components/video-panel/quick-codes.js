/** The person's codes on the digit keys 1 to 9. */

import { preferences } from '../../core/preferences.js';
import { wordFor } from '../../core/words.js';

/**
 * Returns the codes with labels short enough for a button: [{tag, label}]; a tag has all that is given to it.
 * @param {import('../../core/codes.js').Catalogue} catalogue
 */
export const quickCodes = (catalogue) =>
  preferences.value.quick_codes.map((tag) => {
    const { code, char1, char2, severity } = tag;
    const word = wordFor('quick', code) ?? catalogue.label(code, null, null);
    return { tag, label: [word, char1, char2, severity].filter((part) => part ?? false).join(' ') };
  });
