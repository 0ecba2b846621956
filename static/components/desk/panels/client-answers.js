/** What clients said about the inspection by a link, with a reply to each. */

import { html } from '../../../core/page/html.js';
import { isAsked } from '../../../core/defects/review.js';
import { may } from '../../../core/page/rights.js';
import { date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';

/** @param {Api['ReviewOut']} review */
export const clientSection = ({ said }) => html`<section class="stack gap-3 pad-head line-below">
  <p class="row wrap apart gap-row"><b>${t('acceptance.client')}</b>
    ${may('operator') && html`<button type="button" class="button button--small" data-client>${icon('link')}${t('acceptance.title')}</button>`}</p>
  ${said.length === 0 && html`<p class="dim">${t('acceptance.nothing_said')}</p>`}
  <ul>${said.toReversed().map(answerRow)}</ul></section>`;

const answerRow = (answer) => {
  const { id, kind, person, text, at, link, reply, replied_by: who, replied_at: when, is_changed: isOld } = answer;
  const look = isAsked(answer) ? 'sign-weak' : kind === 'accepted' && !isOld ? 'sign-ok' : 'sign-dim';
  return html`<li class="remark entry ${look}">${icon(kind === 'accepted' ? 'check' : 'help')}
    <div><p><b>${wordFor('acceptance.said', kind)}</b> ${isOld && html`<span class="dim">(${t('acceptance.before_change')})</span>`}</p>
      ${text && html`<p class="remark__text breaks">${text}</p>`}
      <p class="dim small breaks">${t('reviewing.by', { who: person, when: date(at) })}${link && html` · ${link}`}</p>
      ${reply !== null && html`<p class="remark__text breaks">${icon('forward')} ${reply}</p><p class="dim small">${t('reviewing.by', { who, when: date(when) })}</p>`}</div>
    ${isAsked(answer) && may('operator') && html`<span class="at-top"><button type="button" class="button button--small" data-reply="${id}">${t('acceptance.reply')}</button></span>`}</li>`;
};

/** Asks for the reply to a client, and sends it. */
export async function replyTo(review, { id, person, text }) {
  const opened = openDialog({
    title: t('acceptance.reply_to', { person }),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate><p class="remark__text breaks">${text}</p>
      <div class="field"><label for="client-reply">${t('acceptance.reply')}</label>
        <textarea class="input" id="client-reply" rows="4" maxlength="2000" data-part="reply"></textarea>
        <span class="help">${t('acceptance.reply_help')}</span></div>${formFoot(t('acceptance.reply'))}</form>`,
  });
  opened.parts.reply.focus();
  closesWhenSent(opened, async () => {
    const reply = opened.parts.reply.value.trim();
    if (!reply) return false;
    await review.reply(id, reply);
  });
  await opened.closed;
}
