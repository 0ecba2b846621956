/** The labels of inspections: as chips, and the dialog that changes them. */

import { get, put } from '../../../core/server/api.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { t } from '../../../core/page/words.js';
import { formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';

/** As the server limits them. */
const LONGEST = 50;
const MOST = 20;

/** Chips on a button; the others are counted. */
const SHOWN = 2;

const IN_USE = '/api/inspections/labels';

/** Labels in use: [{label, inspections}], the most used first. */
export const labelsInUse = async (signal) => (await get(IN_USE, signal)).labels;

/** Chips that narrow a list to the inspections with the same label. */
export const labelFilters = (labels) =>
  html`${labels.map((label) => html`<button class="chip label-chip" data-filter="label" data-value="${label}" title="${t('archive.only', { value: label })}">${label}</button>`)}`;

export const labelChips = (labels) =>
  html`${labels.map((label) => html`<span class="chip label-chip">${label}</span>`)}`;

/** Shows the labels on a button that changes them; who may only look reads them. */
export function showLabelButton(button, labels) {
  const text = labels.join(', ');
  button.disabled = !may('operator');
  button.hidden = button.disabled && labels.length === 0;
  button.title = text || t('labels.change');
  renderNew(
    button,
    html`${icon('label')}<span class="visually-hidden">${t('labels.label')}</span>${labelChips(labels.slice(0, SHOWN))}${labels.length > SHOWN && html`<span class="number">+${labels.length - SHOWN}</span>`}`,
  );
}

/**
 * Lets the person change the labels of an inspection, and offers to take the change back.
 * @param {{id: string, name: string, labels: string[]}} inspection
 * @param {(labels: string[]) => void} onStored also after the change was taken back
 */
export async function editLabels({ id, name, labels }, onStored) {
  const chosen = await askLabels(name, labels);
  if (chosen === null || JSON.stringify(chosen) === JSON.stringify(labels)) return;
  const store = async (wanted) => onStored((await put(`/api/inspections/${id}/labels`, { labels: wanted })).labels);
  await store(chosen);
  toast(t('labels.stored', { name }), { action: t('page.undo'), run: () => orToast(() => store(labels)) });
}

/** Returns the labels that the person wants, or null. */
async function askLabels(name, labels) {
  const chosen = [...labels];
  const { dialog, parts, closed } = openDialog({ title: t('labels.title', { name }), content: formMarkup() });
  const show = () => {
    render(
      parts.chosen,
      html`${chosen.map((label, i) => html`<li><button type="button" class="chip label-chip" data-remove="${i}" title="${t('labels.remove', { label })}"><span class="visually-hidden">${t('labels.remove', { label })}</span><span aria-hidden="true">${label}</span>${icon('close')}</button></li>`)}`,
    );
    parts.none.hidden = chosen.length > 0;
  };
  /** Takes the typed label; false if it cannot be one more. */
  const add = () => {
    const label = parts.label.value.trim();
    if (label && chosen.length >= MOST) {
      parts.said.textContent = t('labels.too_many', { n: MOST });
      return false;
    }
    parts.said.textContent = '';
    parts.label.value = '';
    const isNew = label && !chosen.some((other) => other.toLowerCase() === label.toLowerCase());
    if (isNew) chosen.push(label);
    show();
    return true;
  };
  parts.chosen.addEventListener('click', ({ target }) => {
    const button = target.closest('[data-remove]');
    if (!button) return;
    chosen.splice(Number(button.dataset.remove), 1);
    show();
    (parts.chosen.querySelectorAll('button')[button.dataset.remove] ?? parts.label).focus();
  });
  parts.label.addEventListener('keydown', (event) => {
    if (event.key === 'Enter' && parts.label.value.trim()) {
      event.preventDefault(); // a second Enter stores them
      add();
    } else if (event.key === 'Backspace' && parts.label.value === '' && chosen.length) {
      chosen.pop();
      show();
    }
  });
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    if (add()) dialog.close('stored');
  });
  show();
  parts.label.focus();
  orToast(async () => {
    const known = await labelsInUse();
    render(parts.known, html`${known.map(({ label }) => html`<option value="${label}"></option>`)}`);
  });
  return (await closed) === 'stored' ? chosen : null;
}

const formMarkup = () => html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
  <p class="help">${t('labels.help')}</p>
  <ul class="labels-chosen" data-part="chosen" aria-label="${t('labels.label')}"></ul>
  <p class="dim" data-part="none">${t('labels.none')}</p>
  <div class="field"><label for="labels-new">${t('labels.new')}</label>
    <input class="input" id="labels-new" list="labels-known" maxlength="${LONGEST}" autocomplete="off" aria-describedby="labels-keys labels-fault" data-part="label" />
    <datalist id="labels-known" data-part="known"></datalist>
    <span class="help" id="labels-keys">${t('labels.keys')}</span>
    <span class="fault" id="labels-fault" role="alert" data-part="said"></span></div>
  ${formFoot(t('labels.store'))}</form>`;
