/** The units in which a code has its quantities. */

import { t } from '../../core/words.js';

const UNIT_WORDS = { deg: '°', count: t('form.pieces') };

/**
 * @param {import('../../core/codes.js').CodeRow|null} rules
 * @param {1|2} n
 */
export function unitOf(rules, n) {
  const unit = rules?.[`unit_q${n}`] ?? '';
  return UNIT_WORDS[unit] ?? unit;
}
