/** Work orders of an office: import a table of them, and end one. */

import { put, sendFile } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { newest } from '../../../core/server/newest.js';
import { count, day } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { closesWhenSent, openDialog, orFault } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { toast } from '../../shared/toast-stack/toast-stack.js';

/** Rows that are shown before the import. */
const SHOWN = 8;

/**
 * Imports a table: what its columns hold is guessed and can be changed, what it would do is shown before.
 * @param {File} file
 * @returns {Promise<boolean>} whether anything was stored
 */
export async function importOrders(file) {
  const opened = openDialog({
    title: t('orders.import_title', { name: file.name }),
    size: 'wide',
    content: html`<form method="dialog" class="stack gap-4" data-part="form">
      <ul class="flow gap-3" data-part="columns"></ul>
      <label class="switch row"><input type="checkbox" data-part="adds" />${t('orders.add_assets')}</label>
      <div class="stack gap-4" role="status" data-part="result"></div>
      <div class="unless-empty" role="alert" data-part="fault"></div>
      <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
        <button class="button button--primary" data-part="submit" disabled></button></div></form>`,
  });
  const { parts } = opened;
  let found = null;
  const send = (isDryRun) => {
    const columns = (found?.columns ?? []).map(({ field }) => ['columns', field ?? '']);
    const query = [['dry_run', String(isDryRun)], ['add_assets', String(parts.adds.checked)], ...columns];
    return sendFile(`/api/work-orders/import?${new URLSearchParams(query)}`, file);
  };
  const preview = newest(async () => {
    await orFault({ fault: parts.fault }, async () => {
      found = await send(true);
      const n = found.added + found.changed;
      const focused = document.activeElement?.id;
      render(parts.columns, html`${found.columns.map((column, at) => columnMarkup(column, at, found.fields))}`);
      if (focused?.startsWith('order-column')) document.getElementById(focused)?.focus();
      render(parts.result, resultMarkup(found));
      parts.submit.textContent = t('orders.take', { n, count: count(n) });
      parts.submit.disabled = n === 0;
    });
  });
  parts.adds.addEventListener('change', () => preview());
  parts.columns.addEventListener('change', ({ target: { dataset, value } }) => {
    for (const other of found.columns) if (value && other.field === value) other.field = null; // each is in one column
    found.columns[dataset.at].field = value || null;
    preview();
  });
  closesWhenSent(opened, async () => {
    found = await send(false);
    toast(t('orders.imported', { n: found.added + found.changed, count: count(found.added + found.changed) }));
  });
  preview();
  return (await opened.closed) === 'done';
}

const columnMarkup = ({ name, examples, field }, at, fields) => html`<li class="field">
  <label for="order-column-${at}">${name} <small class="dim">${examples.join(' · ')}</small></label>
  <select class="input" id="order-column-${at}" data-at="${at}"><option value="">${t('register.not_used')}</option>
    ${fields.map((each) => html`<option value="${each}" ${each === field && 'selected'}>${wordFor('orders.field', each)}</option>`)}</select></li>`;

const resultMarkup = ({ added, changed, same, new_assets: assets, faulty, faults, rows }) => html`<ul class="flow">
    <li class="chip">${t('register.count_add', { n: added, count: count(added) })}</li>
    ${changed > 0 && html`<li class="chip">${t('register.count_change', { n: changed, count: count(changed) })}</li>`}
    ${same > 0 && html`<li class="chip">${t('register.count_same', { n: same, count: count(same) })}</li>`}
    ${assets > 0 && html`<li class="chip">${t('orders.new_assets', { n: assets, count: count(assets) })}</li>`}
    ${faulty > 0 && html`<li class="chip chip--failed">${icon('alert')}${t('register.count_fault', { n: faulty, count: count(faulty) })}</li>`}</ul>
  ${
    faults.length > 0 &&
    tableMarkup(
      t('register.faults'),
      [t('register.column'), t('register.fault')],
      faults.map(({ row, column, reason, detail }) => [
        row,
        column ? wordFor('orders.field', column) : t('register.whole_row'),
        html`${wordFor('orders.wrong', reason)} <small class="dim" lang="en">${detail}</small>`,
      ]),
    )
  }
  ${
    rows.length > 0 &&
    tableMarkup(
      t('register.result'),
      ['number', 'asset_id', 'reason', 'due_on'].map((field) => wordFor('orders.field', field)),
      rows
        .slice(0, SHOWN)
        .map(({ row, number, asset_id: asset, reason, due_on: due }) => [row, number, asset, reason, due && day(due)]),
    )
  }`;

const tableMarkup = (
  title,
  heads,
  rows,
) => html`<div class="orders__rows framed" tabindex="0" role="region" aria-label="${title}">
  <table class="plain-table full"><thead><tr><th scope="col">${t('register.row')}</th>${heads.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
  <tbody>${rows.map((cells) => html`<tr>${cells.map((cell) => html`<td>${cell}</td>`)}</tr>`)}</tbody></table></div>`;

/** Asks how an order ends. @returns {Promise<boolean>} whether it has ended */
export async function endOrder(id, number) {
  const opened = openDialog({
    title: t('orders.end_title', { number }),
    content: html`<form method="dialog" class="stack gap-4" data-part="form"><p>${t('orders.end_text')}</p>
      <div class="unless-empty" role="alert" data-part="fault"></div>
      <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
        <button class="button" data-part="drop" value="cancelled">${t('orders.cancel')}</button>
        <button class="button button--primary" data-part="submit" value="closed">${t('orders.close')}</button></div></form>`,
  });
  let state = 'closed';
  opened.parts.form.addEventListener('submit', ({ submitter }) => (state = submitter.value), { capture: true });
  closesWhenSent(opened, () => put(`/api/work-orders/${id}/state`, { state }));
  return (await opened.closed) === 'done';
}
