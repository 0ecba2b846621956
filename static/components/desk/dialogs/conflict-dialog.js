/** Two people changed the same thing: both versions side by side, and the choice. */

import { get, refusalIn } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { date } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { rowsOf } from './conflict-rows.js';

/** Actions in the history that change each kind of content. */
const ACTIONS = {
  observation: ['changed', 'restored', 'deleted'],
  header: ['changed', 'finished'],
  corrections: ['corrected'],
};

/**
 * Asks which version to keep. Dismissing the dialog postpones the decision; it is void when
 * `settled` aborts because another page has decided.
 * @param {Desk} desk
 * @param {import('../../../core/defects/conflicts.js').Conflict} conflict
 * @param {AbortSignal} settled
 * @returns {Promise<'mine'|'theirs'|''>}
 */
export async function askWhichHolds(desk, conflict, settled) {
  const words = wordsFor(conflict);
  const { dialog, parts, closed } = openDialog({
    title: t('conflict.title', { name: nameIn(desk, conflict) }),
    size: conflict.mine && conflict.theirs ? 'wide' : 'narrow',
    content: html`<p>${words.intro}
        <span data-part="who"></span></p>
      ${tableMarkup(rowsOf(conflict, desk.catalogue), conflict)}
      <form method="dialog" class="conflict__foot line-above">
        <p class="help">${t('conflict.later_help')}</p>
        <div class="dialog__buttons">
          <button class="button" value="">${t('conflict.later')}</button>
          <button class="button" value="theirs">${words.take}</button>
          <button class="button button--primary" value="mine">${words.keep}</button>
        </div></form>`,
  });
  dialog.classList.add('conflict');
  settled.addEventListener('abort', () => dialog.close(''), { once: true });
  showWho(desk.inspection.id, conflict, parts.who, settled);
  return /** @type {Promise<'mine'|'theirs'|''>} */ (closed);
}

/** Returns the question, and the words of both answers; either version may be a deletion. */
function wordsFor({ mine, theirs }) {
  if (!mine)
    return { intro: t('conflict.undeleted'), take: t('conflict.undeleted_take'), keep: t('conflict.undeleted_keep') };
  if (!theirs)
    return { intro: t('conflict.deleted'), take: t('conflict.deleted_take'), keep: t('conflict.deleted_keep') };
  return { intro: t('conflict.intro'), take: t('conflict.theirs_take'), keep: t('conflict.mine_keep') };
}

/** @param {Desk} desk @param {import('../../../core/defects/conflicts.js').Conflict} conflict */
function nameIn(desk, { kind, about, mine, theirs }) {
  if (kind === 'header') return t('conflict.header');
  if (kind === 'corrections') return t('conflict.corrections');
  return nameOf(desk.observations.find(about) ?? { ...(mine ?? theirs), distance_m: null });
}

/**
 * Reads the author from the history, if that is reachable.
 * @param {string} inspection
 * @param {import('../../../core/defects/conflicts.js').Conflict} conflict
 * @param {HTMLElement} place
 * @param {AbortSignal} signal
 */
async function showWho(inspection, { kind, about }, place, signal) {
  const query = about ? `?observation=${about}` : '';
  try {
    const { events } = await get(`/api/inspections/${inspection}/events${query}`, signal);
    const last = events.find(({ action }) => ACTIONS[kind].includes(action));
    if (last) place.textContent = t('conflict.who', { who: last.who, when: date(last.at) });
  } catch (error) {
    refusalIn(error);
  }
}

/** Shows the versions side by side; a deletion has no column. */
function tableMarkup(rows, { mine, theirs }) {
  const [isMine, isTheirs] = [mine !== null, theirs !== null];
  const isMarked = ({ isOther }) => isMine && isTheirs && isOther;
  return html`<table class="conflict__table full">
  <thead><tr><th scope="col"><span class="visually-hidden">${t('conflict.field')}</span></th>
    ${isMine && html`<th scope="col">${t('conflict.mine')}</th>`}${isTheirs && html`<th scope="col">${t('conflict.theirs')}</th>`}</tr></thead>
  <tbody>${rows.map(
    (row) => html`<tr${isMarked(row) && html` class="conflict__row--other"`}>
    <th scope="row">${row.label}${isMarked(row) && html` <span class="conflict__mark small weak">${t('conflict.differs')}</span>`}</th>
    ${isMine && html`<td>${row.mine || '–'}</td>`}${isTheirs && html`<td>${row.theirs || '–'}</td>`}</tr>`,
  )}</tbody></table>`;
}
