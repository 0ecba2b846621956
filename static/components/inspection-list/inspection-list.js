/** The start page: all inspections, newest first, updated while something runs. */

import { get, patch, pause, post, remove, sendFile } from '../../core/api.js';
import { html, patchList, render } from '../../core/html.js';
import { isUnfinished } from '../../core/inspection.js';
import { PagedList } from '../../core/paged-list.js';
import { STATES as REVIEW_STATES, isLocked } from '../../core/review.js';
import { may } from '../../core/rights.js';
import { Component } from '../../core/store.js';
import { chainage, count, date, duration } from '../../core/units.js';
import { errorText, t, wordFor } from '../../core/words.js';
import { icon } from '../icon/icon.js';
import { GRAVEST, severityMark } from '../severity-mark/severity-mark.js';
import { STATES, reviewChip, statusChip } from '../status-chip/status-chip.js';
import { orToast, toast, toastError } from '../toast-stack/toast-stack.js';
import { topBar } from '../top-bar/top-bar.js';
import '../pager/pager.js';
import { askDelete, askName, showImported } from './dialogs.js';

const POLL_BUSY_S = 1.5;
/** Pause while nothing runs: others may tag any inspection, and severe defects must show at once. */
const POLL_IDLE_S = 3;
const SAMPLE_POLL_S = 0.5;

class InspectionList extends Component {
  #list;
  /** Ids of inspections whose urgent defects were announced or already there; null before the first answer. */
  #grave = null;

  mount() {
    document.title = t('list.page');
    this.parts = render(
      this,
      html`${topBar()}
        <main id="main" class="content" tabindex="-1">
          <div class="content__head">
            <h1>${t('list.title')}</h1>
            <div class="content__ways"><a class="button" href="/archive">${icon('layers')}${t('archive.title')}</a>
              <a class="button" href="/compare" data-part="compare" hidden>${t('compare.link')}</a>
              <button class="button" data-part="old" data-needs="operator" title="${t('list.import_help')}">${icon('upload')}${t('list.import')}</button>
              <input type="file" accept=".txt,.json,.db3" data-part="file" aria-label="${t('list.import')}" hidden />
              <a class="button button--primary" href="/new" data-needs="operator">${icon('plus')}${t('list.new')}</a></div>
          </div>
          <p class="message message--error" data-part="fault" role="alert" hidden></p>
          <section class="panel empty" data-part="empty" hidden>
            <h2>${t('list.empty')}</h2>
            <p class="dim">${t('list.empty_text')}</p>
            <div class="empty__ways" data-needs="operator">
              <a class="button button--primary" href="/new">${icon('plus')}${t('list.first')}</a>
              <button class="button" data-part="sample">${icon('film')}<span data-part="sampleWord">${t('list.sample')}</span></button>
            </div>
          </section>
          <div data-part="table" hidden>
            <search class="find">
              <div class="field find__text"><label class="visually-hidden" for="find-text">${t('list.search')}</label>
                <input class="input" id="find-text" type="search" autocomplete="off" placeholder="${t('list.search_hint')}"
                  data-part="text" /></div>
              <div class="field"><label class="visually-hidden" for="find-status">${t('list.filter')}</label>
                <select class="input" id="find-status" data-part="status">
                  <option value="">${t('list.all')}</option>
                  ${STATES.map((state) => html`<option value="${state}">${wordFor('status', state)}</option>`)}
                </select></div>
              <div class="field"><label class="visually-hidden" for="find-review">${t('reviewing.filter')}</label>
                <select class="input" id="find-review" data-part="review">
                  <option value="">${t('reviewing.any')}</option>
                  ${REVIEW_STATES.map((state) => html`<option value="${state}">${wordFor('review', state)}</option>`)}
                </select></div>
              <p class="dim number find__count" role="status" data-part="count"></p>
            </search>
            <div class="inspections">
              <div class="inspections__head" aria-hidden="true">
                <span>${t('list.name')}</span><span>${t('list.status')}</span><span>${t('list.length')}</span>
                <span>${t('list.defects')}</span><span>${t('list.worst')}</span><span>${t('list.created')}</span>
              </div>
              <ul data-part="rows" aria-label="${t('list.title')}"></ul>
              <list-pager data-part="pager"></list-pager>
              <p class="panel find__nothing" data-part="nothing" hidden>${t('list.nothing')}
                <button class="button button--small" data-part="clear">${t('list.clear')}</button></p>
            </div>
          </div>
        </main>`,
    );
    const { text, status, review, clear, sample, old, file } = this.parts;
    this.listen(old, 'click', () => file.click());
    this.listen(file, 'change', () => orToast(() => this.#import()));
    this.#list = new PagedList('/api/inspections', { filters: ['search', 'status', 'review'], signal: this.signal });
    text.value = this.#list.filters.search;
    status.value = this.#list.filters.status;
    review.value = this.#list.filters.review;
    this.parts.pager.fill(this.#list);
    const find = () => orToast(() => this.#list.want({ search: text.value, status: status.value, review: review.value }));
    this.listen(text, 'input', find);
    this.listen(status, 'change', find);
    this.listen(review, 'change', find);
    this.listen(clear, 'click', () => {
      text.value = '';
      status.value = review.value = '';
      find();
      text.focus();
    });
    this.listen(sample, 'click', () => this.#makeSample());
    this.listen(this.#list, 'change', () => this.#show());
    this.#list.follow(
      ({ inspections = [] }) => (inspections.some(isUnfinished) ? POLL_BUSY_S : POLL_IDLE_S),
      (error) => this.#showFault(error),
    );
  }

  /** Announces inspections with a defect that became urgent while the page is open. */
  #announceGrave(grave) {
    const isFirst = this.#grave === null;
    this.#grave ??= { ids: new Set(), newest: '' };
    const { ids, newest } = this.#grave;
    for (const { id, name, at } of grave) {
      if (!isFirst && !ids.has(id) && at > newest) this.#announce(id, name);
      ids.add(id);
      if (at > this.#grave.newest) this.#grave.newest = at;
    }
  }

  #announce(id, name) {
    toast(t('list.grave', { name }), {
      kind: 'error',
      action: t('list.open'),
      run: () => location.assign(`/inspections/${id}`),
    });
  }

  #show() {
    const { parts } = this;
    const { inspections, total, stored, grave } = this.#list.value;
    this.#announceGrave(grave);
    parts.empty.hidden = stored > 0;
    parts.table.hidden = stored === 0;
    parts.compare.hidden = stored < 2;
    parts.nothing.hidden = total > 0 || stored === 0;
    parts.count.textContent = total < stored ? t('list.found', { shown: count(total), all: count(stored) }) : '';
    patchList(parts.rows, inspections, ({ id }) => id, (item) => this.#createRow(item), updateRow);
  }

  #inspection(id) {
    return this.#list.value.inspections.find((other) => other.id === id);
  }

  #createRow({ id }) {
    const item = createRow(id);
    item.parts.rename.addEventListener('click', () => orToast(() => this.#rename(id)));
    item.parts.remove.addEventListener('click', () => orToast(() => this.#delete(id)));
    return item;
  }

  async #rename(id) {
    const { name } = this.#inspection(id);
    const wanted = await askName(name);
    if (wanted === null) return;
    await patch(`/api/inspections/${id}`, { name: wanted });
    await this.#list.again();
    toast(t('list.renamed', { name: wanted }));
  }

  async #delete(id) {
    const inspection = this.#inspection(id);
    if (!(await askDelete(inspection))) return;
    await remove(`/api/inspections/${id}`);
    await this.#list.again();
    this.querySelector('#main').focus();
    toast(t('list.deleted', { name: inspection.name }));
  }

  /** Imports old surveys of other programs, and exported inspections; the server detects the format. */
  async #import() {
    const { old, file } = this.parts;
    const [chosen] = file.files;
    if (!chosen) return;
    old.disabled = true;
    try {
      const path = `/api/imports?filename=${encodeURIComponent(chosen.name)}`;
      const imported = await sendFile(path, chosen, this.signal);
      await this.#list.again();
      showImported(chosen.name, imported);
    } finally {
      file.value = ''; // so that the same file may be chosen again
      old.disabled = false;
    }
  }

  /** Requests the sample, which the server renders once and then keeps. */
  async #makeSample() {
    const { sample, sampleWord } = this.parts;
    sample.disabled = true;
    await orToast(async () => {
      let made = await post('/api/samples');
      while (made.state === 'rendering' && !this.signal.aborted) {
        sampleWord.textContent = t('list.sample_making', { percent: Math.floor(100 * made.progress) });
        await pause(SAMPLE_POLL_S, this.signal);
        made = await get('/api/samples', this.signal);
      }
      if (made.error) toastError(made.error);
      else location.assign(`/inspections/${made.inspection_id}`);
    });
    sample.disabled = false;
    sampleWord.textContent = t('list.sample');
  }

  #showFault(error) {
    this.parts.fault.hidden = error === null;
    if (!error) return;
    const reason = errorText(error);
    const text = error.isTemporary ? t('page.trying_again', { reason }) : reason;
    render(this.parts.fault, html`${icon('alert')}<span>${text}</span>`);
  }
}

const isGrave = ({ worst_severity: worst }) => worst === GRAVEST;

/** A draft without a question needs no word. */
const reviewMarkup = ({ review: { state }, open_questions: n }) =>
  html`${state !== 'draft' && reviewChip(state)} ${n > 0 && html`<span class="chip chip--reopened">${icon('help')}${t('reviewing.questions', { n })}</span>`}`;

const graveChip = () =>
  html`<span class="chip chip--grave">${icon('alert')}${wordFor('severity', String(GRAVEST))}</span>`;

function createRow(id) {
  const item = document.createElement('li');
  item.className = 'inspection panel';
  item.parts = render(
    item,
    html`<div class="inspection__name">
        <a href="/inspections/${id}" data-part="name"></a>
        <span class="dim" data-part="source"></span>
      </div>
      <div class="inspection__status">
        <span data-part="chip"></span>
        <span class="inspection__progress" data-part="progress">
          <progress class="bar" data-part="bar" max="1" aria-label="${t('progress.label')}"></progress>
          <span class="dim number" data-part="pace"></span>
        </span>
        <span class="inspection__error" data-part="error"></span>
      </div>
      <div class="inspection__fact"><span class="label">${t('list.length')}</span><b class="number" data-part="length"></b></div>
      <div class="inspection__fact"><span class="label">${t('list.defects')}</span><b class="number" data-part="defects"></b></div>
      <div class="inspection__fact"><span class="label">${t('list.worst')}</span><span data-part="worst"></span></div>
      <time class="dim number" data-part="created"></time>
      <div class="inspection__actions">
        <button class="button button--quiet button--small button--icon" data-part="rename" data-needs="operator">${icon('edit')}</button>
        <button class="button button--quiet button--small button--icon" data-part="remove" data-needs="admin">${icon('trash')}</button>
      </div>`,
  );
  return item;
}

function updateRow({ parts, classList }, inspection) {
  const { name, status, progress, distance_m, defects, worst_severity, created_at } = inspection;
  const { header, source, error } = inspection;
  parts.name.textContent = name;
  parts.source.textContent = [header.asset_id, source.filename].filter(Boolean).join(' · ');
  render(parts.chip, html`${statusChip(status)} ${isGrave(inspection) && graveChip()} ${reviewMarkup(inspection)}`);
  parts.progress.hidden = !isUnfinished(inspection);
  parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
  parts.pace.textContent = status === 'running' ? pace(progress) : t('progress.waits');
  parts.error.textContent = error ? errorText(error) : '';
  parts.length.textContent = chainage(distance_m);
  parts.defects.textContent = String(defects);
  render(parts.worst, worstMarkup(worst_severity));
  classList.toggle('inspection--grave', isGrave(inspection));
  parts.created.dateTime = created_at;
  parts.created.textContent = date(created_at);
  for (const [part, label] of [['rename', t('list.rename_named', { name })], ['remove', t('list.delete_named', { name })]]) {
    parts[part].setAttribute('aria-label', label);
  }
  parts.rename.title = t('list.rename');
  const isOpen = !isLocked(inspection);
  parts.rename.disabled = !isOpen;
  parts.remove.title = may('admin') ? t('list.delete') : t('rights.admin');
  parts.remove.disabled = !may('admin') || !isOpen;
}

function worstMarkup(severity) {
  if (severity === null) return html`<span class="dim">–</span>`;
  const word = wordFor('severity', String(severity));
  return html`<span class="inspection__worst">${severityMark(severity)}<b>${severity}</b>
    ${severity === GRAVEST ? html`<b>${word}</b>` : html`<span class="dim">${word}</span>`}</span>`;
}

/** '63 % · 84 frames/s · 20 s left' */
export function pace({ frames_done, frames_total, fps, eta_s }) {
  const done = frames_total
    ? t('progress.percent', { percent: Math.min(100, Math.floor((100 * frames_done) / frames_total)) })
    : t('progress.frames', { n: frames_done });
  const speed = fps ? t('progress.speed', { fps: Math.round(fps) }) : null;
  const isKnown = eta_s !== null && eta_s !== undefined;
  const left = isKnown ? t('progress.left', { time: duration(eta_s) }) : null;
  return [done, speed, left].filter(Boolean).join(' · ');
}

customElements.define('inspection-list', InspectionList);
