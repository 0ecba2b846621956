/** Reports of many inspections as one archive: which formats, how far it is, what could not be made. */

import { ApiError, get, poll, post, remove } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { bytes, count, lengthUnit } from '../../core/units.js';
import { errorText, language, t, wordFor } from '../../core/words.js';
import { showFault } from '../archive-shell/archive-shell.js';
import { openDialog } from '../dialog/dialog.js';
import { GROUPS, formatOf } from '../export-dialog/formats.js';
import { icon } from '../icon/icon.js';

const LOOK_S = 0.5;
const EXTRAS = ['burnt_in', 'clips'];
/** What most clients want of many inspections. */
const CHOSEN_AT_FIRST = ['pdf', 'xlsx'];
/** As the server limits them. */
const MOST = 1000;

/** @param {string[]} ids inspections, in the order of the archive */
export function openBulkExport(ids) {
  const { dialog, parts } = openDialog({
    title: t('bulk.title', { n: ids.length, count: count(ids.length) }),
    content: markup(),
    question: () => (made.isUnsaved ? { title: t('bulk.leave_title'), text: t('bulk.leave_text'), submit: t('bulk.leave') } : null),
  });
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  const made = new BulkExport(ids, dialog, parts, end.signal);
}

class BulkExport {
  /** Whether an archive is being made, or is made and nobody has saved it: it ends with the dialog. */
  isUnsaved = false;
  #ids;
  #dialog;
  #parts;
  #signal;
  /** Address of the archive that is being made, or is made. */
  #path = null;

  constructor(ids, dialog, parts, signal) {
    this.#ids = ids;
    this.#dialog = dialog;
    this.#parts = parts;
    this.#signal = signal;
    parts.formats.addEventListener('change', () => this.#showChoice());
    parts.make.addEventListener('click', () => this.#make());
    parts.cancel.addEventListener('click', () => dialog.close());
    // The archive is for this dialog only; one that is read at this moment is sent to its end.
    signal.addEventListener('abort', () => this.#discard());
    this.#showChoice();
    parts.result.addEventListener('click', ({ target }) => target.closest('[data-part=download]') && (this.isUnsaved = false));
    if (ids.length > MOST) this.#fail(t('bulk.too_many', { most: count(MOST) }));
  }

  get #formats() {
    return [...this.#parts.formats.querySelectorAll('[data-format]:checked')].map(({ dataset }) => dataset.format);
  }

  #showChoice() {
    const formats = this.#formats;
    this.#parts.make.disabled = formats.length === 0 || this.#ids.length === 0 || this.#ids.length > MOST;
    for (const extra of EXTRAS) {
      const isOf = formats.some((kind) => formatOf(kind).extras?.includes(extra));
      this.#parts[extra].disabled = !isOf;
    }
  }

  async #make() {
    const { formats, fault, make, burnt_in: burntIn, clips } = this.#parts;
    const wanted = this.#formats;
    render(fault, html``);
    make.disabled = formats.disabled = true;
    this.isUnsaved = true;
    try {
      await this.#discard(); // one that came to nothing
      const { id } = await post('/api/bulk-exports', {
        inspections: this.#ids,
        formats: wanted,
        lang: language,
        units: lengthUnit,
        burnt_in: burntIn.checked && !burntIn.disabled,
        clips: clips.checked && !clips.disabled,
      });
      this.#path = `/api/bulk-exports/${id}`;
      if (this.#signal.aborted) return this.#discard();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.#fail(errorText(error));
      return;
    }
    poll(
      async () => {
        const progress = await get(this.#path, this.#signal);
        this.#show(progress);
        return ['waiting', 'running'].includes(progress.state) ? LOOK_S : null;
      },
      this.#signal,
      (error) => (error.isTemporary ? showFault(fault, error) : this.#fail(errorText(error))),
    );
  }

  #show({ state, done, total, present, not_made: notMade, not_made_total: missing, size, detail }) {
    const { making, bar, announced, choice, result, cancel, make, fault } = this.#parts;
    showFault(fault, null);
    const isMade = state === 'done';
    if (state === 'failed') return this.#fail(detail);
    choice.hidden = true;
    making.hidden = isMade;
    make.hidden = true;
    cancel.textContent = isMade ? t('page.close') : t('page.cancel');
    bar.max = total;
    bar.value = done;
    announced.textContent =
      state === 'waiting' ? t('bulk.waiting') : t('bulk.at', { done: count(done), total: count(total), name: present ?? '' });
    if (!isMade) return;
    const parts = render(
      result,
      html`<p class="export__all">${icon('check')}<span role="status">${t('bulk.made', { n: total, count: count(total), size: bytes(size) })}</span></p>
        <p><a class="button button--primary" href="${this.#path}/archive" download data-part="download">${icon('download')}${t('export.download')}</a></p>
        ${missing > 0 && html`<h3>${t('bulk.not_made', { n: missing, count: count(missing) })}</h3>
          <p class="help">${t('bulk.not_made_help')}</p>
          <ul class="export__list bulk__missing" tabindex="0">${notMade.map(({ name, format, detail: why }) => html`<li class="export__row">${icon('alert')}
            <span><b>${name || t('bulk.deleted')}</b> ${format && formatOf(format).name}: <span lang="en">${why}</span></span></li>`)}
            ${missing > notMade.length && html`<li class="dim">${t('finish.and_more', { n: missing - notMade.length })}</li>`}</ul>`}`,
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
    render(fault, html`<p class="message message--error">${icon('alert')}<span>${reason}</span></p>`);
    make.focus();
  }

  async #discard() {
    if (this.#path === null) return;
    try {
      await remove(this.#path);
    } catch (error) {
      // Another archive may have replaced it; without a network it is replaced later.
      if (!(error instanceof ApiError)) throw error;
    }
  }
}

const markup = () => html`<div class="export bulk">
  <div class="bulk__choice" data-part="choice"><p>${t('bulk.help')}</p>
    <fieldset class="bulk__formats" data-part="formats"><legend class="visually-hidden">${t('bulk.formats')}</legend>
      ${GROUPS.map(({ title, formats }) => html`<div><h3>${title}</h3>${formats.map(({ kind, name }) => html`<label class="switch"><input type="checkbox"
        data-format="${kind}" ${CHOSEN_AT_FIRST.includes(kind) && html`checked`} />${name}</label>`)}</div>`)}
      <div class="bulk__extras">${EXTRAS.map((name) => html`<label class="switch"><input type="checkbox"
        data-part="${name}" />${wordFor('export.extra', name)}</label>`)}</div>
    </fieldset></div>
  <div data-part="fault" role="alert"></div>
  <div class="export__making" data-part="making" hidden>
    <progress class="bar" data-part="bar" value="0" aria-label="${t('export.making')}"></progress>
    <p class="number" role="status" data-part="announced"></p>
  </div>
  <section data-part="result"></section>
  <div class="dialog__buttons">
    <button class="button" data-part="cancel">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="make">${icon('download')}${t('bulk.make')}</button>
  </div></div>`;
