/** Before a report is sent to anybody: what its format cannot hold, and the open issues. */

import { refusalIn } from '../../../core/server/api.js';
import {
  discard,
  exportPath,
  extraFields,
  follow,
  lossesOf,
  makeExport,
  order,
  save,
} from '../../../core/survey/exports.js';
import { html, render } from '../../../core/page/html.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { bytes, lengthUnit } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { showFault } from '../../shared/page-frame/page-frame.js';
import { sentenceOf } from '../../desk/panels/sentences.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { toast } from '../../shared/toast-stack/toast-stack.js';
import { deliveryChoices } from './formats.js';

/** Number of losses and checks shown at first. */
const SHOWN_AT_FIRST = 5;
const TICK_MS = 1000;

/**
 * @param {import('../../desk/page/desk.js').Desk} desk
 * @param {import('./formats.js').Format} format
 */
export function openExport(desk, format) {
  const { dialog, parts } = openDialog({
    title: t('export.title', { name: format.name }),
    content: markup(format, desk.inspection.value),
    question: () => (format.isOrdered && shown.isMaking ? stop() : null),
  });
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  const shown = new ExportDialog(desk, format, dialog, parts, end.signal);
}

/** Asks before a file as large as a film is dropped. */
const stop = () => ({ title: t('export.stop_title'), text: t('export.stop_text'), submit: t('export.stop') });

class ExportDialog {
  #desk;
  #format;
  #dialog;
  #parts;
  #signal;
  /** Aborts the report that is being made. */
  #making = null;
  /** null until they are known */
  #losses = null;

  constructor(desk, format, dialog, parts, signal) {
    this.#desk = desk;
    this.#format = format;
    this.#dialog = dialog;
    this.#parts = parts;
    this.#signal = signal;
    const on = (target, type, run) => target.addEventListener(type, run, { signal });
    on(desk.checks, 'change', () => this.#showChecks());
    on(parts.checks, 'click', ({ target }) => target.closest('[data-open]') && this.#leaveTo('checks'));
    on(parts.losses, 'click', ({ target }) => {
      const button = target.closest('button');
      if (button?.dataset.observation) this.#goTo(button.dataset.observation);
      else if (button) this.#showLosses(Infinity);
    });
    on(parts.fault, 'click', ({ target }) => target.closest('[data-open]') && this.#leaveTo('header'));
    on(parts.leave, 'click', () => (this.#making ? this.#making.abort() : dialog.close()));
    on(parts.download, 'click', () => this.#download());
    this.#showChecks();
    desk.checks.loadSoon();
    if (!format.isWhole) this.#askLosses();
    parts.download.focus();
  }

  get isMaking() {
    return this.#making !== null;
  }

  async #askLosses() {
    const { inspection } = this.#desk;
    this.#parts.losses.hidden = false;
    try {
      await this.#desk.whenSent(this.#signal);
      this.#losses = await lossesOf(inspection.id, this.#format.kind, this.#signal);
    } catch (error) {
      if (!refusalIn(error)) return;
      this.#parts.losses.hidden = true;
      this.#showFault(error);
      return;
    }
    this.#showLosses();
  }

  #showLosses(most = SHOWN_AT_FIRST) {
    const losses = this.#losses;
    const rest = losses.length - most;
    const { observations } = this.#desk;
    render(
      this.#parts.losses,
      losses.length === 0
        ? html`<p class="export__all">${icon('check')}<span>${t('export.holds_all')}</span></p>`
        : html`<h3>${t('export.losses', { n: losses.length })}</h3><p class="help">${t('export.losses_help')}</p>
          <ul class="stack gap-1">${losses.slice(0, most).map(
            ({ detail, observation_id: id }) => html`<li class="export__row">
            ${icon('alert')}<span>${detail}</span>${
              id &&
              observations.find(id) &&
              html`<button class="button button--small"
              data-observation="${id}">${t('checks.go')}</button>`
            }</li>`,
          )}</ul>
          ${rest > 0 && html`<p><button class="button button--small">${t('export.more', { n: rest })}</button></p>`}`,
    );
  }

  #showChecks() {
    const { checks, observations } = this.#desk;
    const issues = checks.value;
    if (issues === null) return;
    const blocking = issues.filter(({ level }) => level === 'block');
    const rest = issues.length - blocking.length;
    this.#parts.word.textContent = blocking.length ? t('export.download_draft') : t('export.download');
    const summary = [
      blocking.length && t('checks.blocking', { n: blocking.length }),
      rest && t('checks.warnings', { n: rest }),
    ].filter(Boolean);
    render(
      this.#parts.checks,
      issues.length === 0
        ? html`<p class="export__all">${icon('check')}<span>${t('export.nothing_against')}</span></p>`
        : html`<h3>${summary.join(' · ')}</h3>
          ${
            blocking.length > 0 &&
            html`<p class="help">${t('export.blocking_help')}</p>
          <ul class="stack gap-1">${blocking.slice(0, SHOWN_AT_FIRST).map(
            (issue) => html`<li class="export__row export__row--block">
            ${icon('stop')}<span>${sentenceOf(issue, issue.observation_id && observations.find(issue.observation_id))}</span></li>`,
          )}
            ${blocking.length > SHOWN_AT_FIRST && html`<li class="dim">${t('finish.and_more', { n: blocking.length - SHOWN_AT_FIRST })}</li>`}</ul>`
          }
          <p><button class="button button--small" data-open>${t('export.open_checks')}</button></p>`,
    );
  }

  async #download() {
    const { inspection } = this.#desk;
    this.#making = new AbortController();
    const signal = AbortSignal.any([this.#signal, this.#making.signal]);
    render(this.#parts.fault, html``);
    this.#showMaking(true);
    const since = performance.now();
    const timer = setInterval(() => {
      this.#parts.seconds.textContent = t('units.seconds', { s: Math.round((performance.now() - since) / 1000) });
    }, TICK_MS);
    try {
      // The report includes the last tags.
      await this.#desk.whenSent(signal);
      if (!this.#format.isOrdered && this.#extras.includes('film')) {
        follow(exportPath(inspection.id, this.#format.kind, this.#extras), '');
        this.#dialog.close();
        toast(t('export.begun'));
        return;
      }
      const file = this.#format.isOrdered
        ? await this.#makeOrder(inspection.id, signal)
        : await makeExport(inspection.id, this.#format.kind, this.#extras, signal);
      if (signal.aborted || file === null) return;
      if ('url' in file) follow(file.url, file.name);
      else save(file);
      this.#dialog.close();
      toast(t('export.saved', { name: file.name, size: bytes(file.size) }));
    } catch (error) {
      if (!refusalIn(error)) return;
      this.#showFault(error);
    } finally {
      clearInterval(timer);
      this.#making = null;
      this.#showMaking(false);
    }
  }

  /**
   * Has the server make the file on its disk, where a film has room.
   * @returns {Promise<{url: string, name: string, size: number}|null>} null if it came to nothing
   */
  async #makeOrder(id, signal) {
    const { exchange, lang, announced, fault } = this.#parts;
    const wanted = {
      inspections: [id],
      formats: [this.#format.kind],
      lang: lang.value,
      units: lengthUnit,
      exchange: exchange.value,
      ...extraFields(this.#extras),
    };
    /** @type {Api['BulkExportOut']|null} */
    let progress = null;
    const show = (present) => {
      progress = present;
      showFault(fault, null);
      announced.textContent =
        present.state === 'waiting' ? t('bulk.waiting') : t('export.written', { size: bytes(present.written) });
    };
    const path = await order(wanted, signal, show, (error) => showFault(fault, error));
    if (path === null) return null;
    if (progress.state === 'done') return { url: `${path}/archive`, name: progress.filename, size: progress.size };
    await discard(path);
    render(
      fault,
      html`<p class="message message--error">${icon('alert')}<span lang="${lang.value}">${progress.detail}</span></p>`,
    );
    return null;
  }

  get #extras() {
    return [...this.#parts.extras.querySelectorAll(':checked')].map(({ name }) => name);
  }

  #showMaking(isMaking) {
    const { making, download, leave, announced, seconds } = this.#parts;
    making.hidden = !isMaking;
    download.disabled = isMaking;
    seconds.textContent = '';
    announced.textContent = isMaking ? t('export.making') : '';
    leave.textContent = isMaking ? t('export.stop') : t('page.cancel');
    (isMaking ? leave : download).focus();
  }

  #showFault(error) {
    const lacksPlace = error.code === 'export_not_available' && this.#format.kind === 'geojson';
    render(
      this.#parts.fault,
      html`<p class="message message--error">${icon('alert')}<span>${lacksPlace ? t('export.needs_place') : errorText(error)}
        ${lacksPlace && html`<button class="button button--small" data-open>${t('checks.header')}</button>`}</span></p>`,
    );
  }

  #goTo(id) {
    this.#desk.goTo(id);
    this.#leaveTo('defects');
  }

  #leaveTo(tab) {
    this.#desk.tab.set(tab);
    this.#dialog.close();
  }
}

/** Names an extra; of the film its size, which decides whether somebody wants to send it. */
const extraName = (name, { source }) =>
  name === 'film' ? `${wordFor('export.extra', name)} (${bytes(source.size)})` : wordFor('export.extra', name);

/** Returns the extras that an inspection can have: without a film there is none to send. */
const extrasOf = (extras, inspection) => extras.filter((name) => name !== 'film' || hasFilm(inspection));

/** @param {import('./formats.js').Format} format @param {Api['InspectionOut']} inspection */
const markup = ({ help, extras = [], isOrdered }, inspection) => html`<div class="export stack gap-4">
  <div class="export__content stack gap-4 packed scrolls" tabindex="0" role="region" aria-label="${t('export.about')}">
    <p>${help}</p>
    <div class="export__extras" data-part="extras">${extrasOf(extras, inspection).map(
      (name) => html`<label class="switch row"><input type="checkbox"
      name="${name}" />${extraName(name, inspection)}</label>`,
    )}</div>
    ${isOrdered && deliveryChoices()}
    <div data-part="fault" role="alert"></div>
    <div class="stack" data-part="making" hidden>
      <progress class="bar export__bar" aria-label="${t('export.making')}"></progress>
      <p class="number"><span role="status" data-part="announced"></span> <span class="dim" data-part="seconds"></span></p>
    </div>
    <section class="stack" data-part="losses" role="status" hidden><p class="dim">${t('export.looking')}</p></section>
    <section class="stack" data-part="checks"><p class="dim">${t('checks.looking')}</p></section>
  </div>
  <div class="dialog__buttons">
    <button class="button" data-part="leave">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="download">${icon('download')}<span data-part="word">${t('export.download')}</span></button>
  </div></div>`;
