/**
 * Imports a table into the register, in place of the list: what its columns hold is guessed and can be changed, what the
 * import would do is shown, and what is left out is listed afterwards with its reason.
 *
 * `open(file)` begins. Event `done` (detail: {added, changed}, or null if nothing was imported): the list may be shown
 * again.
 */

import { refusalIn } from '../../../core/server/api.js';
import { newest } from '../../../core/server/newest.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { MOST_BYTES, importTable } from '../../../core/survey/register.js';
import { bytes, count } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** Rows that are shown before the import. */
const SHOWN = 12;
const KEY = 'asset_id';
const NODES = ['start_node', 'end_node'];

/** What is no field of a header. */
const OWN_NAMES = {
  project: t('archive.project'),
  diameter_mm: t('register.diameter'),
  wkt: t('register.wkt'),
};

export class RegisterImport extends Component {
  /** @type {File} */
  #file;
  #found;
  /** What was imported so far. */
  #done = null;
  #ask = newest((columns) => this.#preview(columns));

  mount() {
    this.hidden = true;
    this.className = 'register-import stack gap-4';
  }

  /** Begins with a table. @param {File} file */
  open(file) {
    this.#file = file;
    this.#done = null;
    this.hidden = false;
    /** @type {Parts<'register-page/register-import'>} */
    this.parts = render(
      this,
      html`<div class="row gap-row wrap apart">
          <div class="row gap-row wrap"><h2>${t('register.import_title', { name: file.name })}</h2>
            <div role="status" data-part="state"></div></div>
          <span class="flow">
            <button class="button" data-part="cancel">${t('page.cancel')}</button>
            <button class="button button--primary" data-part="take" hidden></button></span></div>
        <p class="fault" role="alert" data-part="fault"></p>
        <div class="register-import__body gap-5" data-part="body" hidden>
          <section class="panel pad-4 stack" aria-labelledby="import-columns">
            <h3 id="import-columns">${t('register.columns')}</h3>
            <ul class="stack gap-row" data-part="columns"></ul></section>
          <section class="stack gap-4 holds" data-part="result"></section></div>`,
    );
    const { cancel, take, columns } = this.parts;
    this.listen(cancel, 'click', () => this.#leave());
    this.listen(take, 'click', () => this.#take());
    this.listen(columns, 'change', ({ target }) => this.#changed(target));
    if (file.size > MOST_BYTES)
      this.parts.fault.textContent = t('register.too_large', { size: bytes(file.size), most: bytes(MOST_BYTES) });
    else this.#ask([]);
  }

  #leave() {
    this.hidden = true;
    this.replaceChildren();
    this.dispatchEvent(new CustomEvent('done', { detail: this.#done }));
  }

  /** What the person says that the columns hold, as the server takes it. */
  get #columns() {
    return this.#found.columns.map(({ field, unit }) => [field ?? '', unit].filter((part) => part !== null).join(':'));
  }

  /** Asks the server, and shows what it says or why it refuses. */
  async #send(columns, isDryRun) {
    const { fault, state, take } = this.parts;
    fault.textContent = '';
    take.disabled = true;
    state.textContent = isDryRun ? t('register.checking') : t('register.importing');
    try {
      return await importTable(this.#file, isDryRun, columns, this.signal);
    } catch (error) {
      if (refusalIn(error)) fault.textContent = errorText(error);
      state.textContent = '';
      return null;
    }
  }

  async #preview(columns) {
    const found = await this.#send(columns, true);
    if (!found) return;
    const isFirst = !this.#found || columns.length === 0;
    this.#found = found;
    const { body, state, take, result } = this.parts;
    const changes = found.added + found.changed;
    render(state, countsMarkup(found));
    take.textContent = t('register.take_all', { n: changes, count: count(changes) });
    take.hidden = changes === 0;
    take.disabled = false;
    body.hidden = false;
    this.#showColumns();
    render(result, previewMarkup(found));
    if (isFirst) take.focus();
  }

  /** Keeps the focus, as the selects are drawn anew. */
  #showColumns() {
    const { columns } = this.parts;
    const focused = columns.contains(document.activeElement) ? document.activeElement.id : null;
    render(columns, html`${this.#found.columns.map((column, at) => columnMarkup(column, at, this.#found.fields))}`);
    if (focused) columns.querySelector(`#${focused}`)?.focus();
  }

  #changed({ dataset: { field: at, unit: of }, value }) {
    const { columns } = this.#found;
    if (of !== undefined) columns[of].unit = value;
    else {
      // Each thing is in one column.
      for (const other of columns)
        if (value && other.field === value) Object.assign(other, { field: null, unit: null });
      const { units } = this.#found.fields.find(({ name }) => name === value) ?? { units: [] };
      const own = value.endsWith('_m') ? 'm' : 'mm';
      Object.assign(columns[at], { field: value || null, unit: units.length ? own : null });
    }
    this.#showColumns();
    this.#ask(this.#columns);
  }

  async #take() {
    // The register may have changed since the dry run: what is done now is what counts.
    const found = await this.#send(this.#columns, false);
    if (!found) return;
    this.#done = { added: found.added, changed: found.changed };
    if (found.faulty === 0) {
      this.#leave();
      return;
    }
    const { state, take, cancel, body } = this.parts;
    render(state, html``);
    take.remove();
    cancel.textContent = t('page.close');
    cancel.focus();
    body.className = 'stack gap-4';
    render(body, restMarkup(found));
  }
}

const nameOf = (field) => OWN_NAMES[field] ?? wordFor('header', field) ?? field;

/** One column of the table: its name, some cells, what they are, and their unit. */
function columnMarkup({ name, examples, field, unit }, at, fields) {
  const { units } = fields.find((each) => each.name === field) ?? { units: [] };
  return html`<li class="register-import__column">
    <span class="holds"><b class="one-line">${name || t('register.nameless', { n: at + 1 })}</b>
      <small class="one-line dim">${examples.join(' · ')}</small></span>
    <select class="input" id="import-field-${at}" data-field="${at}" aria-label="${t('register.holds', { name })}">
      <option value="">${t('register.not_used')}</option>
      ${fields.map((each) => html`<option value="${each.name}" ${each.name === field && html`selected`}>${nameOf(each.name)}</option>`)}
    </select>
    ${
      units.length > 0 &&
      html`<select class="input" id="import-unit-${at}" data-unit="${at}" aria-label="${t('register.unit_of', { name })}">
      ${units.map((each) => html`<option value="${each}" ${each === unit && html`selected`}>${each}</option>`)}</select>`
    }</li>`;
}

const countsMarkup = ({ added, changed, same, faulty }) => html`<ul class="flow">
  <li class="chip">${t('register.count_add', { n: added, count: count(added) })}</li>
  ${changed > 0 && html`<li class="chip">${t('register.count_change', { n: changed, count: count(changed) })}</li>`}
  ${same > 0 && html`<li class="chip">${t('register.count_same', { n: same, count: count(same) })}</li>`}
  ${faulty > 0 && html`<li class="chip chip--failed">${icon('alert')}${t('register.count_fault', { n: faulty, count: count(faulty) })}</li>`}</ul>`;

/** What would be stored of the first rows, and what would not. */
function previewMarkup(found) {
  const { rows, columns, added, changed, same, faulty, warnings } = found;
  const good = rows.filter(({ action }) => action !== 'fault');
  const held = columns.map(({ field }) => (field === 'diameter_mm' ? 'height_mm' : field));
  const shown = [...new Set(held)].filter((field) => good.some(({ header }) => header[field] !== undefined));
  const isNamed = held.includes(KEY) || NODES.every((node) => held.includes(node));
  return html`${!isNamed && html`<p class="message message--error">${icon('alert')}<span>${t('register.which_id')}</span></p>`}
    ${isNamed && faulty > 0 && faultsMarkup(t('register.left_out'), found)}
    ${
      good.length > 0 &&
      html`<h3>${t('register.first_rows', { n: Math.min(good.length, SHOWN), total: count(added + changed + same) })}</h3>
      ${tableMarkup(
        t('register.result'),
        [t('archive.asset'), ...shown.map(nameOf), t('register.action')],
        good
          .slice(0, SHOWN)
          .map(({ row, asset_id: id, header, action }) => [
            row,
            id,
            ...shown.map((field) => written(field, header[field])),
            wordFor('register.actions', action),
          ]),
      )}`
    }
    ${
      warnings.length > 0 &&
      html`<p class="message message--warning">${icon('alert')}<span>${t('register.alike')}</span></p>
      ${tableMarkup(
        t('register.alike'),
        [t('archive.asset'), t('register.known_as')],
        warnings.map(({ row, asset_id: id, same: others }) => [row, id, others.join(', ')]),
      )}`
    }`;
}

/** What was stored, and the rest. */
const restMarkup = (found) =>
  html`<p class="message">${icon('check')}<span>${t('register.imported', {
    n: found.added + found.changed,
    added: count(found.added),
    changed: count(found.changed),
  })}</span></p>${faultsMarkup(t('register.rest'), found)}`;

/** Faults of which the server's sentence says more: what an id lacks, the range and the unit of a field. */
const DETAILED = new Set(['id', 'value', 'place']);

/** The rows that are left out, with their reasons. */
function faultsMarkup(text, { faults, faulty, rows, columns }) {
  const ids = new Map(rows.map(({ row, asset_id: id }) => [row, id]));
  const isAll = new Set(faults.map(({ row }) => row)).size === faulty;
  const named = (column) => columns.find(({ field }) => field === column)?.name ?? column;
  return html`<p class="message message--warning">${icon('alert')}<span>${text}${!isAll && ` ${t('register.more_faults', { n: faults.length })}`}</span></p>
    ${tableMarkup(
      t('register.faults'),
      [t('archive.asset'), t('register.column'), t('register.fault')],
      faults.map(({ row, column, detail, reason, found }) => [
        row,
        ids.get(row) ?? '',
        column ? named(column) : t('register.whole_row'),
        html`${wordFor('register.wrong', reason, { found })}
          ${DETAILED.has(reason) && html`<small class="dim" lang="en">${detail}</small>`}`,
      ]),
    )}`;
}

/** A value with its unit. */
function written(field, value) {
  if (value === undefined) return '';
  if (/_mm$|_m$/.test(field)) return `${value} ${field.split('_').at(-1)}`;
  return wordFor('header.choice', value) ?? value;
}

function tableMarkup(title, heads, rows) {
  return html`<div class="register-import__rows framed" tabindex="0" role="region" aria-label="${title}"><table class="plain-table full">
  <thead><tr><th scope="col">${t('register.row')}</th>${heads.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
  <tbody>${rows.map(([row, ...cells]) => html`<tr><td class="number">${row}</td>${cells.map((cell) => html`<td>${cell}</td>`)}</tr>`)}</tbody></table></div>`;
}

customElements.define('register-import', RegisterImport);
