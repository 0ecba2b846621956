/** Links by which a client sees inspections and accepts them: make one, see what was said, end one. */

import { get, post, remove } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { count, date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { ask, openDialog, orFault } from '../../shared/dialog/dialog.js';
import { showOnce } from '../../shared/dialog/show-once.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const LINKS = '/api/acceptance-links';
/** As the server limits them. */
const [USUAL_DAYS, MOST_DAYS, MOST] = [30, 365, 200];
/** What a chip of each state looks like. */
const LOOKS = {
  open: 'queued',
  question: 'reopened',
  answered: 'submitted',
  accepted: 'approved',
  changed: 'reopened',
};

/**
 * @param {string[]} ids inspections of a new link
 * @param {string} [inspection] only the links to this one are listed
 */
export async function openAcceptance(ids, inspection) {
  const { parts, closed } = openDialog({
    title: t('acceptance.title'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
        <p>${t('acceptance.help', { n: ids.length, count: count(ids.length) })}</p>
        <div class="field"><label for="acceptance-note">${t('acceptance.note')}</label>
          <input class="input" id="acceptance-note" maxlength="200" autocomplete="off" aria-describedby="acceptance-note-help" data-part="note" />
          <span class="help" id="acceptance-note-help">${t('acceptance.note_help')}</span></div>
        <div class="field"><label for="acceptance-days">${t('acceptance.days')}</label>
          <input class="input" id="acceptance-days" type="number" min="1" max="${MOST_DAYS}" value="${USUAL_DAYS}" data-part="days" /></div>
        <div class="unless-empty" role="alert" data-part="fault"></div>
        <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.close')}</button>
          <button class="button button--primary" data-part="submit">${icon('link')}${t('acceptance.make')}</button></div></form>
      <section class="stack gap-3" aria-labelledby="acceptance-links"><h3 id="acceptance-links">${t('acceptance.links')}</h3>
        <ul class="stack gap-3" data-part="links"></ul></section>`,
  });
  const show = async () => {
    const { links } = await get(inspection ? `${LINKS}?inspection=${inspection}` : LINKS);
    render(
      parts.links,
      links.length ? html`${links.map(linkMarkup)}` : html`<li class="dim">${t('acceptance.none')}</li>`,
    );
  };
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    orFault(parts, async () => {
      const wanted = { inspections: ids, note: parts.note.value.trim(), days: Number(parts.days.value) };
      const { path } = await post(LINKS, wanted);
      await showOnce({
        title: t('acceptance.made'),
        text: t('acceptance.made_text'),
        label: t('acceptance.address'),
        address: `${location.origin}${path}`,
      });
      await show();
    });
  });
  parts.links.addEventListener('click', ({ target }) => {
    const { revoke } = target.closest('[data-revoke]')?.dataset ?? {};
    if (revoke) orToast(async () => (await askRevoke()) && (await remove(`${LINKS}/${revoke}`), await show()));
  });
  if (ids.length > MOST) {
    parts.submit.disabled = true;
    parts.fault.textContent = t('acceptance.too_many', { most: count(MOST) });
  }
  parts.note.focus();
  await orToast(show);
  await closed;
}

const askRevoke = () =>
  ask({ title: t('acceptance.revoke_title'), text: t('acceptance.revoke_text'), submit: t('acceptance.revoke') });

const linkMarkup = ({
  id,
  note,
  state,
  made_at: made,
  made_by: who,
  expires_at: until,
  opened,
  opened_at: last,
  sections,
}) => html`<li class="stack gap-1 framed pad-3">
  <p class="row apart gap-row"><b class="breaks">${note || t('acceptance.nameless')}</b>
    ${state !== 'valid' && html`<span class="chip chip--cancelled">${wordFor('acceptance.state', state)}</span>`}
    ${state === 'valid' && may('operator') && html`<button type="button" class="button button--small" data-revoke="${id}">${t('acceptance.revoke')}</button>`}</p>
  <p class="dim small">${t('acceptance.made_by', { who, when: date(made) })} · ${t('acceptance.until', { when: date(until) })}
    · ${opened ? t('acceptance.opened', { n: opened, count: count(opened), when: date(last) }) : t('acceptance.unopened')}</p>
  <ul class="stack gap-1">${sections.map(
    ({ inspection_id: of, name, is_deleted: isDeleted, standing }) => html`<li class="row apart gap-row">
    ${isDeleted ? html`<span class="dim">${name}</span>` : html`<a class="one-line" href="/inspections/${of}">${name}</a>`}
    ${isDeleted ? html`<span class="chip chip--cancelled">${t('acceptance.deleted')}</span>` : standingChip(standing)}</li>`,
  )}</ul></li>`;

/** How a section stands with the client. @param {Api['SectionOut']['standing']} standing */
const standingChip = (standing) =>
  html`<span class="chip chip--${LOOKS[standing]}">${wordFor('acceptance.standing', standing)}</span>`;
