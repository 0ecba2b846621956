/** The person's codes on the digit keys 1 to 9. */

import { preferences } from '../../core/preferences.js';
import { wordFor } from '../../core/words.js';

/**
 * Returns the codes with labels short enough for a button: [{code, char1, char2, label}].
 * @param {import('../../core/codes.js').Catalogue} catalogue
 */
export const quickCodes = (catalogue) =>
  preferences.value.quick_codes.map(({ code, char1, char2 }) => {
    const word = wordFor('quick', code) ?? catalogue.label(code, null, null);
    return { code, char1, char2, label: [word, char1, char2].filter(Boolean).join(' ') };
  });
