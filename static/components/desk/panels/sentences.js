/** The sentence of a check, in the language of the page. */

import { chainage, withSign } from '../../../core/wall/units.js';
import { wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { labelOf } from './differences.js';

/**
 * @param {Api['IssueOut']} issue
 * @param {object|null} observation of the issue
 */
export function sentenceOf({ code, detail, params }, observation) {
  const {
    field,
    known_length_m: lengthM,
    short_m: shortM,
    residual_mm: residualMm,
  } = /** @type {Record<string, any>} */ (params);
  const values = {
    ...params,
    name: observation ? nameOf(observation) : '',
    field: field && labelOf(field),
    length: lengthM && chainage(lengthM),
    short: shortM && chainage(shortM),
    residual: residualMm && withSign(residualMm, 0),
  };
  return wordFor('issue', code, values) ?? detail;
}
