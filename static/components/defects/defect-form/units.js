/** The units in which a code has its quantities. */

import { t } from '../../../core/page/words.js';

const UNIT_WORDS = { deg: '°', count: t('form.pieces') };

/** The word or sign for a unit of a quantity; '' for none. */
export const unitWord = (unit) => UNIT_WORDS[unit] ?? unit ?? '';

/**
 * @param {import('../../../core/defects/codes.js').CodeRow|null} rules
 * @param {1|2} n
 */
export function unitOf(rules, n) {
  return unitWord(rules?.[`unit_q${n}`]);
}
