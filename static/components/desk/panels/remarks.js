/** Remarks of a reviewer as rows, and the changes of them, which can be undone. */

import { html } from '../../../core/page/html.js';
import { newId } from '../../../core/page/new-id.js';
import { preferences } from '../../../core/page/preferences.js';
import { isOpen } from '../../../core/defects/review.js';
import { may, mayEdit } from '../../../core/page/rights.js';
import { date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** @type {Record<import('../../../core/defects/review.js').Remark['kind'], import('../../shared/icon/icon.js').IconName>} */
const SIGNS = { accepted: 'check', question: 'help', comment: 'edit' };

/**
 * A remark as an item of a list.
 * @param {import('../../../core/defects/review.js').Remark} remark
 * @param {{name?: string, isOld?: boolean}} [about] the defect's name where it is not obvious; whether it
 *     was edited since
 */
export function remarkRow(remark, { name, isOld = false } = {}) {
  const { id, kind, text, by, at, observation, settled_at: settled, settled_by: settledBy } = remark;
  const isMine = by === preferences.person?.name || may('admin');
  return html`<li class="remark entry ${isOpen(remark) ? 'sign-weak' : kind === 'accepted' ? 'sign-ok' : 'sign-dim'}">${icon(SIGNS[kind])}
    <div>
      <p>${name && html`<button type="button" class="link" data-go="${observation}">${name}</button> `}<b>${wordFor('remark', kind)}</b>
        ${isOld && html`<span class="dim">(${t('reviewing.edited_since')})</span>`}</p>
      ${text && html`<p class="remark__text breaks">${text}</p>`}
      <p class="dim small">${t('reviewing.by', { who: by, when: date(at) })}${settled && html` · ${t('reviewing.settled_by', { who: settledBy, when: date(settled) })}`}</p>
    </div>
    ${
      mayEdit() &&
      html`<span class="flow gap-1 at-top">
      ${kind === 'question' && html`<button type="button" class="button button--small" data-settle="${id}">${settled ? t('reviewing.unsettle') : t('reviewing.settle')}</button>`}
      ${
        isMine &&
        html`<button type="button" class="button button--quiet button--small button--icon" data-withdraw="${id}"
        aria-label="${t('reviewing.withdraw')}" title="${t('reviewing.withdraw')}">${icon('trash')}</button>`
      }</span>`
    }</li>`;
}

/** Says something about an observation as the person sees it. */
export async function say(desk, item, kind, text) {
  const remark = { id: newId(), observation: item.id, kind, text, version: item.version };
  await desk.review.say(remark);
  note(desk, item, remark, (isBack) => (isBack ? desk.review.withdraw(remark.id) : desk.review.say(remark)));
}

/** Takes the step that a button of a row stands for, if it is one. */
export async function pressed(desk, { target }) {
  const { go, settle, withdraw } = target.closest('[data-go], [data-settle], [data-withdraw]')?.dataset ?? {};
  if (go) goToDefect(desk, go);
  const remark = desk.review.value?.remarks.find(({ id }) => id === (settle ?? withdraw));
  const item = remark && desk.observations.find(remark.observation);
  if (!item) return;
  if (settle) {
    const isSettled = isOpen(remark);
    await desk.review.settle(settle, isSettled);
    note(desk, item, { kind: 'settled' }, (isBack) => desk.review.settle(settle, isSettled !== isBack));
  } else {
    await desk.review.withdraw(withdraw);
    // Only what this person says again is the same: not another's remark, a settled one, or an acceptance, which
    // would be of the defect as it is now.
    const isSame = remark.by === preferences.person?.name && !remark.settled_at && remark.kind !== 'accepted';
    if (isSame)
      note(desk, item, remark, (isBack) => (isBack ? desk.review.say(remark) : desk.review.withdraw(withdraw)));
    desk.done(t('reviewing.withdrawn'), isSame ? {} : { action: null });
  }
}

/** Opens the next defect about which a question is open, after the selected one. */
export function goToQuestion(desk) {
  const asked = new Set(desk.review.questions.map(({ observation }) => observation));
  const items = desk.observations.value;
  const here = items.findIndex(({ id }) => id === desk.selection.value) + 1;
  const next = [...items.slice(here), ...items.slice(0, here)].find(({ id }) => asked.has(id));
  if (next) goToDefect(desk, next.id);
  else desk.fault(t('reviewing.no_questions'));
}

/** Opens the defect that a remark is about. */
function goToDefect(desk, id) {
  if (!desk.observations.find(id)) return; // deleted meanwhile
  desk.goTo(id);
  desk.tab.set('defects');
  desk.editing.set(true);
}

/** Remarks are few and short: an undo does not ask what others have done meanwhile. */
function note(desk, item, remark, run) {
  desk.history.add({ what: 'remark', item, changes: [remark], run, isOvertaken: async () => false });
}
