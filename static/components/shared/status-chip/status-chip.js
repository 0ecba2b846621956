/** The states of an inspection and of its review, or of a film of the archive, as a word and a sign. */

import { html } from '../../../core/page/html.js';
import { plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';

const SIGNS = { queued: 'wait', running: 'live', done: 'check', failed: 'alert', cancelled: 'stop' };

/** States of a film before it is an inspection. */
const SIGNS_BEFORE = { unassigned: 'help', ready: 'play', waiting: 'wait', paused: 'pause', refused: 'alert' };

const SIGNS_OF_REVIEW = {
  draft: 'edit',
  submitted: 'forward',
  in_review: 'search',
  approved: 'lock',
  reopened: 'undo',
};

export const STATES = Object.keys(SIGNS);
export const FILM_STATES = [...Object.keys(SIGNS_BEFORE), ...STATES];

export const statusSign = (status) => icon(SIGNS[status] ?? SIGNS_BEFORE[status]);

/**
 * The state, and how well the end of what is done is known: amber where that is of no use.
 * @param {string} status
 * @param {{distance_u95_m: number|null, is_useful: boolean|null}} end
 */
export function statusChip(status, { distance_u95_m: u95M, is_useful: isUseful }) {
  const word = wordFor('status', status);
  if (status === 'failed' && isUseful) {
    return html`<span class="chip chip--useless" title="${t('fitness.carried')}">${icon('alert')}<span>${t('fitness.untracked')} <span class="number">${plusMinus(u95M)}</span></span></span>`;
  }
  if (status !== 'done' || isUseful === null) {
    return html`<span class="chip chip--${status}">${statusSign(status)}${word}</span>`;
  }
  const known = html`${word} <span class="number">${plusMinus(u95M)}</span>`;
  return isUseful
    ? html`<span class="chip chip--done">${statusSign(status)}<span>${known}</span></span>`
    : html`<span class="chip chip--useless" title="${t('fitness.useless')}">${icon('alert')}<span>${known}</span></span>`;
}

/** Says that an older program tracked a film. @param {boolean} outdated */
export const outdatedChip = (outdated) =>
  outdated &&
  html`<span class="chip chip--outdated" title="${t('outdated.text')}">${icon('alert')}${t('outdated.word')}</span>`;

/** The same on a row of a list: a click narrows the list to all of these. @param {boolean} outdated */
export const outdatedFilter = (outdated) =>
  outdated &&
  html`<button class="chip-button" data-filter="outdated" data-value="true" title="${t('outdated.text')}">${outdatedChip(true)}</button>`;

/** The state of the review of an inspection. */
export const reviewChip = (state) =>
  html`<span class="chip chip--${state}">${icon(SIGNS_OF_REVIEW[state])}${wordFor('review', state)}</span>`;
