/** What differs between two walls in register: findings that only one of them shows, or that have grown. */

import { get } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { t, wordFor } from '../../../core/page/words.js';
import { placeText, sizeText, titleOf } from '../../defects/finding-queue/words.js';

/**
 * Reads the findings of both runs and lists the differences; what is new waits in the queue of the later run.
 * @param {Api['DifferenceOut'][]|null} differences null: the same detector has not searched both walls
 * @param {import('./run.js').Run} earlier
 * @param {import('./run.js').Run} later
 * @param {AbortSignal} signal
 */
export async function differencesMarkup(differences, earlier, later, signal) {
  if (differences === null) return html`<p class="help pad-3">${t('walls.not_searched')}</p>`;
  if (differences.length === 0) return html`<p class="help pad-3">${t('walls.no_difference')}</p>`;
  const read = async ({ path }) =>
    new Map((await get(`${path}/findings`, signal)).findings.map((finding) => [finding.id, finding]));
  const [of, before] = await Promise.all([read(later), read(earlier)]);
  const rows = differences
    .map(({ mark, finding, earlier_finding: gone }) => ({
      mark,
      finding: of.get(finding) ?? before.get(gone),
      run: finding ? later : earlier,
    }))
    .filter(({ finding }) => finding);
  return html`<details class="more pad-3" open><summary>${t('walls.differences', { n: rows.length })}</summary>
    <ul class="pad-1">${rows.map(rowMarkup)}</ul></details>`;
}

const rowMarkup = ({ mark, finding, run }) => {
  const where = `/inspections/${run.id}?${new URLSearchParams({ finding: finding.id })}`;
  return html`<li class="row wrap gap-row"><b>${wordFor('assets.change', mark)}</b>
    <a class="shrinks" href="${where}">${titleOf(finding)}</a>
    <span class="number dim">${[placeText(finding), sizeText(finding)].filter(Boolean).join(' · ')}</span>
    <span class="dim">${stateOf(mark, finding)}</span></li>`;
};

/** What is gone was proposed in the earlier run: nobody need decide about it now. */
const stateOf = (mark, { state }) => {
  if (state !== 'offered') return wordFor('finding_state', state);
  return mark === 'gone' ? t('walls.only_earlier') : t('walls.undecided');
};
