/** Names the evidence for corrections in words, and why something cannot be used. */

import { chainage } from '../wall/units.js';
import { t } from '../page/words.js';

/** The server names evidence in English, in three forms. @type {[RegExp, (parts: string[]) => string][]} */
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

/** @type {Record<string, (params: any) => string>} */
const REFUSALS = {
  no_joints: () => t('refusal.no_joints'),
  one_joint: () => t('refusal.one_joint'),
  uncountable: (params) => t('refusal.uncountable', params),
  uncertain_gap: (params) => t('refusal.uncertain_gap', params),
  few_counted: (params) => t('refusal.few_counted', params),
  unexplained_scale: (params) => t('refusal.unexplained_scale', params),
  undecided_scale: (params) => t('refusal.undecided_scale', params),
  contradiction: ({ evidence, other_evidence: other, ...scales }) =>
    t('refusal.contradiction', { ...scales, evidence: evidenceText(evidence), other_evidence: evidenceText(other) }),
  impossible_length: ({ length_m: length, measured_m: measured }) =>
    t('refusal.impossible_length', { length: chainage(length), measured: chainage(measured) }),
  length_lost: (params) => t('refusal.length_lost', params),
  untracked_mark: (params) => t('refusal.untracked_mark', params),
  lost_mark: (params) => t('refusal.lost_mark', params),
  mark_off_the_wall: (params) => t('refusal.mark_off_the_wall', params),
  no_segment: () => t('corrections.no_segment'),
};

/**
 * Returns why something cannot correct the distances, or null where only the server's sentence explains it.
 * @typedef {{code: string, params: Record<string, number|string>}} Reason
 *
 * @param {Reason|null|undefined} reason
 */
export const refusalText = (reason) => (reason ? REFUSALS[reason.code]?.(reason.params) : null) ?? null;
