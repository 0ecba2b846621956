/** Reports of many inspections as one archive: which formats, how far it is, what could not be made. */

import { ApiError } from '../../../core/server/api.js';
import { discard, extraFields, order } from '../../../core/survey/exports.js';
import { html, render } from '../../../core/page/html.js';
import { bytes, count, lengthUnit } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { showFault } from '../../shared/page-frame/page-frame.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { FOLDED_GROUPS, IN_FRONT, deliveryChoices, formatOf } from '../../reports/export-dialog/formats.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';

/** @type {import('../../reports/export-dialog/formats.js').Format['extras']} */
const EXTRAS = ['burnt_in', 'clips', 'film', 'csv_german', 'photos'];
/** What only one format has, so that it is named. */
const OF_ONE = { csv_german: 'csv', photos: 'json' };
/** These make an order large. */
const LARGE = ['clips', 'film'];
/** What most clients want of many inspections. */
const CHOSEN_AT_FIRST = ['pdf', 'xlsx'];
/** As the server limits them. */
const MOST = 1000;
const MOST_WITH_FILMS = 100;

/** @param {string[]} ids inspections, in the order of the archive */
export function openBulkExport(ids) {
  const { dialog, parts } = openDialog({
    title: t('bulk.title', { n: ids.length, count: count(ids.length) }),
    content: markup(),
    question: () =>
      made.isUnsaved ? { title: t('bulk.leave_title'), text: t('bulk.leave_text'), submit: t('bulk.leave') } : null,
  });
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  const made = new BulkExport(ids, dialog, parts, end.signal);
}

class BulkExport {
  /** Whether an archive is being made, or is made and nobody has saved it: it ends with the dialog. */
  isUnsaved = false;
  #ids;
  #parts;
  #signal;
  /** Address of the archive that is being made, or is made. */
  #path = null;
  /** What the server has last said of it. */
  #progress = null;

  constructor(ids, dialog, parts, signal) {
    this.#ids = ids;
    this.#parts = parts;
    this.#signal = signal;
    parts.choice.addEventListener('change', () => this.#showChoice());
    parts.make.addEventListener('click', () => this.#make());
    // The archive is for this dialog only; one that is read at this moment is sent to its end.
    signal.addEventListener('abort', () => this.#path && discard(this.#path));
    this.#showChoice();
    parts.result.addEventListener(
      'click',
      ({ target }) => target.closest('[data-part=download]') && (this.isUnsaved = false),
    );
    if (ids.length > MOST) this.#fail(t('bulk.too_many', { most: count(MOST) }));
  }

  get #formats() {
    return [...this.#parts.formats.querySelectorAll('[data-format]:checked')].map(({ dataset }) => dataset.format);
  }

  /** Whether an extra is wanted of a format that has it. */
  #has(extra) {
    const { checked: isChecked, disabled: isDisabled } = this.#parts[extra];
    return isChecked && !isDisabled;
  }

  #showChoice() {
    const { make, choices, limit, document: whole } = this.#parts;
    const formats = this.#formats;
    for (const extra of EXTRAS) {
      const isShown = extra === 'burnt_in' && whole.checked;
      this.#parts[extra].disabled = !isShown && !formats.some((kind) => formatOf(kind).extras?.includes(extra));
    }
    choices.hidden = !formats.includes('delivery');
    const isTooLarge = this.#ids.length > MOST_WITH_FILMS && LARGE.some((extra) => this.#has(extra));
    limit.textContent = isTooLarge ? t('bulk.too_many_films', { most: count(MOST_WITH_FILMS) }) : '';
    const isNothing = formats.length === 0 && !whole.checked;
    make.disabled = isNothing || isTooLarge || this.#ids.length === 0 || this.#ids.length > MOST;
  }

  get #wanted() {
    const { document: whole, exchange, lang } = this.#parts;
    return {
      inspections: this.#ids,
      formats: this.#formats,
      document: whole.checked,
      lang: lang.value,
      units: lengthUnit,
      exchange: exchange.value,
      ...extraFields(EXTRAS.filter((extra) => this.#has(extra))),
    };
  }

  async #make() {
    const { formats, fault, make } = this.#parts;
    const wanted = this.#wanted;
    render(fault, html``);
    make.disabled = formats.disabled = true;
    this.isUnsaved = true;
    try {
      if (this.#path) await discard(this.#path); // one that came to nothing
      this.#path = await order(
        wanted,
        this.#signal,
        (progress) => this.#show(progress),
        (error) => showFault(fault, error),
      );
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.#fail(errorText(error));
      return;
    }
    if (this.#path) this.#showMade();
  }

  #show(progress) {
    const { making, bar, announced, choice, make, fault } = this.#parts;
    const { state, done, total, present } = progress;
    this.#progress = progress;
    showFault(fault, null);
    choice.hidden = make.hidden = true;
    making.hidden = false;
    bar.max = total;
    bar.value = done;
    announced.textContent =
      state === 'waiting'
        ? t('bulk.waiting')
        : t('bulk.at', { done: count(done), total: count(total), name: present ?? '' });
  }

  #showMade() {
    const { making, result, cancel } = this.#parts;
    const { state, not_made: notMade, not_made_total: missing, size, detail } = this.#progress;
    const lang = this.#parts.lang.value;
    if (state === 'failed') return this.#fail(html`<span lang="${lang}">${detail}</span>`);
    making.hidden = true;
    cancel.textContent = t('page.close');
    const n = this.#ids.length;
    const parts = render(
      result,
      html`<p class="export__all">${icon('check')}<span role="status">${t('bulk.made', { n, count: count(n), size: bytes(size) })}</span></p>
        <p><a class="button button--primary" href="${this.#path}/archive" download data-part="download">${icon('download')}${t('export.download')}</a></p>
        ${
          missing > 0 &&
          html`<h3>${t('bulk.not_made', { n: missing, count: count(missing) })}</h3>
          <p class="help">${t('bulk.not_made_help')}</p>
          <ul class="stack gap-1 bulk__missing" tabindex="0">${notMade.map(
            ({ name, format, detail: why }) => html`<li class="export__row">${icon('alert')}
            <span><b>${name || t('bulk.deleted')}</b> ${format && nameOf(format)}: <span lang="${lang}">${why}</span></span></li>`,
          )}
            ${missing > notMade.length && html`<li class="dim">${t('finish.and_more', { n: missing - notMade.length })}</li>`}</ul>`
        }`,
    );
    parts.download.focus();
  }

  #fail(reason) {
    const { making, choice, make, fault, formats } = this.#parts;
    this.isUnsaved = false;
    making.hidden = true;
    choice.hidden = make.hidden = false;
    formats.disabled = false;
    this.#showChoice();
    render(fault, message('error', reason));
    make.focus();
  }
}

const extraName = (extra) => {
  const words = wordFor('export.extra', extra);
  return OF_ONE[extra] ? `${words} (${nameOf(OF_ONE[extra])})` : words;
};

const nameOf = (kind) => (kind === 'document' ? t('bulk.document') : formatOf(kind).name);

const formatBox = (kind) => html`<label class="switch row"><input type="checkbox"
  data-format="${kind}" ${CHOSEN_AT_FIRST.includes(kind) && html`checked`} />${nameOf(kind)}</label>`;

const markup = () => html`<div class="bulk stack gap-4">
  <div class="stack gap-4" data-part="choice"><p>${t('bulk.help')}</p>
    <fieldset class="bulk__formats stack gap-3" data-part="formats"><legend class="visually-hidden">${t('bulk.formats')}</legend>
      <div class="whole-row flow gap-4">${IN_FRONT.map(formatBox)}</div>
      <details class="whole-row more"><summary>${t('export.more_formats')}</summary><div class="bulk__formats stack gap-3">
        ${FOLDED_GROUPS.map(({ title, formats }) => html`<div><h3>${title}</h3>${formats.map(({ kind }) => formatBox(kind))}</div>`)}</div></details>
      <div class="whole-row"><h3>${t('bulk.whole')}</h3><label class="switch row"><input type="checkbox" data-part="document" />${t('bulk.document')}</label>
        <p class="help">${t('bulk.document_help')}</p></div>
      <div class="whole-row">${EXTRAS.map(
        (name) => html`<label class="switch row"><input type="checkbox"
        data-part="${name}" />${extraName(name)}</label>`,
      )}</div>
      ${deliveryChoices()}
      <p class="message whole-row unless-empty" role="status" data-part="limit"></p>
    </fieldset></div>
  <div data-part="fault" role="alert"></div>
  <div class="stack" data-part="making" hidden>
    <progress class="bar" data-part="bar" value="0" aria-label="${t('export.making')}"></progress>
    <p class="number" role="status" data-part="announced"></p>
  </div>
  <section data-part="result"></section>
  <div class="dialog__buttons">
    <button class="button" data-part="cancel">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="make">${icon('download')}${t('bulk.make')}</button>
  </div></div>`;
