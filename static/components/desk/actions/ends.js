/**
 * Start and end of a survey where nobody has coded them: proposals of the checks, which are stored only when a person
 * confirms them.
 */

import { isUnfinished } from '../../../core/survey/inspection.js';
import { t } from '../../../core/page/words.js';

const OTHER = 'Z';
const MANHOLE = 'A';

/**
 * @typedef {object} ProposedEnd
 * @property {string} issue no_start or no_finish
 * @property {string} code
 * @property {number} frame
 * @property {[number, number]|null} pixel
 * @property {number} distance_m
 * @property {string|null} char1 the likely kind; null where nobody can know
 * @property {{value: string, label: string}[]} kinds
 */

/**
 * Returns the start and the end that are proposed; no end while the run goes on, unless it is about to be finished.
 * @param {Desk} desk
 * @param {{isEnding?: boolean, isAbandoned?: boolean}} [options]
 * @returns {ProposedEnd[]}
 */
export function proposedEnds(desk, { isEnding = !isUnfinished(desk.inspection.value), isAbandoned = false } = {}) {
  // The checks follow some time after the observations.
  const coded = new Set(desk.observations.value.map(({ code }) => code));
  return (desk.checks.value ?? [])
    .filter((issue) => !codesOf(issue).some((code) => coded.has(code)))
    .filter(({ code, params }) => (code === 'no_start' || (code === 'no_finish' && isEnding)) && 'frame' in params)
    .map((issue) => {
      const codes = codesOf(issue);
      return endOf(desk, issue, codes[isAbandoned ? codes.length - 1 : 0]);
    });
}

/** The codes of which one is needed, that of an abandoned survey last. @param {Api['IssueOut']} issue */
export const codesOf = ({ params }) => String(params.needed).split('/');

/**
 * Returns one code at the place that a check proposes.
 * @param {Desk} desk
 * @param {Api['IssueOut']} found
 * @param {string} code
 * @returns {ProposedEnd}
 */
export function endOf(desk, { code: issue, params }, code) {
  const { frame, distance_m, u, v } = /** @type {Record<string, any>} */ (params);
  const kinds = desk.catalogue.firstChars(code);
  // Culverts begin and end at headwalls, which have no letter of their own, and sewers at manholes.
  const likely = desk.inspection.value.header.asset_type === 'culvert' ? OTHER : MANHOLE;
  const isNode = code !== 'BDC';
  const char1 = isNode && kinds.some(({ value }) => value === likely) ? likely : null;
  return { issue, code, frame, pixel: u === undefined ? null : [u, v], distance_m, char1, kinds };
}

/**
 * Makes an observation of a proposal.
 * @param {Desk} desk
 * @param {ProposedEnd} end
 * @param {string} [reason] why the survey was abandoned; '' if it was not
 */
export function confirmEnd(desk, { code, char1, frame, pixel }, reason) {
  const remark = reason || (char1 === OTHER ? t('ends.headwall') : null);
  return desk.tag({ frame, pixel, code, char1, remark, isSelected: false });
}
