/** The codes on the digit keys 1 to 9, and how a code with its details is named shortly. */

import { USUAL_CODES, preferences, templateOf } from '../../../core/page/preferences.js';
import { codeOf } from '../../../core/defects/codes.js';
import { clockRange } from '../../../core/wall/units.js';
import { wordFor } from '../../../core/page/words.js';

/**
 * Returns the codes with labels short enough for a button: [{tag, label}]; a tag has all that is given to it. A key has
 * the person's code, else that of the code pack, else the usual one: the first that the pack of the inspection has.
 * @param {import('../../../core/defects/codes.js').Catalogue} catalogue
 */
export const quickCodes = (catalogue) =>
  preferences.value.quick_codes.map((own, i) => {
    const keyed = catalogue.keyed(String(i + 1));
    const tags = [own, keyed && templateOf(codeOf(keyed)), USUAL_CODES[i]];
    const tag = tags.find((one) => one && catalogue.has(one.code)) ?? own;
    return { tag, label: nameOfCode(catalogue, tag) };
  });

/** Returns a label with quantities and clock position too. */
export function quickLabel(catalogue, tag) {
  const { quant1, quant2, clock_from: from, clock_to: to } = tag;
  const clock = from === null ? null : clockRange(from, to);
  return [nameOfCode(catalogue, tag), quant1, quant2, clock].filter((part) => part !== null).join(' · ');
}

/** @param {import('../../../core/defects/codes.js').Catalogue} catalogue @param {Api['QuickCode']} tag */
function nameOfCode(catalogue, { code, char1, char2, severity }) {
  const word = (catalogue.isBuiltIn && wordFor('quick', code)) || catalogue.label(code, null, null);
  return [word, char1, char2, severity].filter((part) => part ?? false).join(' ');
}
