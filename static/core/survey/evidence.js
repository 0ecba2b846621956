/** Names the evidence for corrections in words, and why something cannot be used. */

import { chainage } from '../wall/units.js';
import { t, wordFor } from '../page/words.js';

/** The server names evidence in English, in four forms. @type {[RegExp, (parts: string[]) => string][]} */
const FORMS = [
  [
    /^([\d.]+) m ± ([\d.]+) mm between frames (\d+) and (\d+)$/,
    ([, metres, sigma, first, last]) =>
      t('corrections.by_length', { length: chainage(Number(metres)), sigma, first, last }),
  ],
  [
    /^(\d+) joints ([\d.]+) mm apart$/,
    ([, n, mm]) => t('corrections.by_joints', { n: Number(n), length: chainage(Number(mm) / 1000) }),
  ],
  [
    /^crests ([\d.]+) mm apart at (\d+) places$/,
    ([, mm, n]) => t('corrections.by_crests', { n: Number(n), pitch: mm }),
  ],
  [/^the rig, to ([\d.e-]+) %$/, ([, percent]) => t('corrections.by_rig', { percent })],
];

/** @param {string} evidence as the server names it */
export function evidenceText(evidence) {
  for (const [pattern, words] of FORMS) {
    const match = pattern.exec(evidence);
    if (match) return words(match);
  }
  return evidence;
}

/** @param {string} evidence as the server names it */
export const isOfJoints = (evidence) => FORMS[1][0].test(evidence);

/**
 * Returns why something cannot correct the distances, or null where only the server's sentence explains it.
 * @typedef {{code: string, params: Record<string, any>}} Reason
 *
 * @param {Reason|null|undefined} reason
 */
export function refusalText(reason) {
  if (!reason) return null;
  const { evidence, other_evidence: other, length_m: lengthM, measured_m: measuredM } = reason.params;
  return wordFor('refusal', reason.code, {
    ...reason.params,
    ...(evidence && { evidence: evidenceText(evidence), other_evidence: evidenceText(other) }),
    ...(lengthM && { length: chainage(lengthM), measured: chainage(measuredM) }),
  });
}
