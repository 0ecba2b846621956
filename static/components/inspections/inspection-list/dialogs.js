/** Dialogs that ask before the list changes something. */

import { html } from '../../../core/page/html.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { t } from '../../../core/page/words.js';
import { ask, formFoot, openDialog } from '../../shared/dialog/dialog.js';

/** Asks for another name; returns it, or null. */
export async function askName(name) {
  const { dialog, parts, closed } = openDialog({
    title: t('confirm.rename_title'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="rename-name">${t('confirm.name')}</label>
        <input class="input" id="rename-name" maxlength="200" autocomplete="off" aria-describedby="rename-fault"
          data-part="name" />
        <span class="fault" id="rename-fault" data-part="nameFault"></span></div>
      ${formFoot(t('confirm.rename_submit'))}</form>`,
  });
  parts.name.value = name;
  parts.name.select();
  parts.name.focus();
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    const wanted = parts.name.value.trim();
    parts.nameFault.textContent = wanted ? '' : t('confirm.name_needed');
    parts.name.setAttribute('aria-invalid', String(!wanted));
    if (wanted) dialog.close(wanted);
  });
  const wanted = await closed;
  return wanted && wanted !== name ? wanted : null;
}

/** Asks whether an inspection may be deleted; it cannot be undone, so the question names it. */
export const askDelete = ({ name, defects }) =>
  ask({
    title: t('confirm.delete_title', { name }),
    text: t('confirm.delete_text', { defects: t('confirm.delete_defects', { n: defects }) }),
    submit: t('confirm.delete_submit'),
  });

/** Shows the result of importing old surveys: the inspections, and what is odd or left out. */
export function showImported(filename, { inspections, warnings }) {
  const { dialog, parts } = openDialog({
    title: t('list.imported_title', { filename }),
    content: html`<div class="imported">
      <p>${t('list.imported', { n: inspections.length })}
        ${!inspections.some(hasFilm) && t('list.imported_without_film')}</p>
      <ul class="imported__list stack gap-1">${inspections.map(
        ({ id, name, observations }) => html`<li><a
        href="/inspections/${id}">${name}</a> <span class="dim">${t('list.imported_rows', { n: observations })}</span></li>`,
      )}</ul>
      ${
        warnings.length
          ? html`<h3>${t('list.import_warnings', { n: warnings.length })}</h3>
        <ul class="imported__list stack gap-1 help breaks">${warnings.map((text) => html`<li>${text}</li>`)}</ul>`
          : ''
      }
      <div class="dialog__buttons"><button type="button" class="button button--primary" data-part="done">${t('page.close')}</button></div>
    </div>`,
    size: 'wide',
  });
  parts.done.focus();
  parts.done.addEventListener('click', () => dialog.close());
}
