/**
 * One asset: what the register says of it, its inspections over the years, and its defects side by side, with
 * what each survey shows of them: new, grown, gone, unchanged. The server decides that.
 */

import { get, poll } from '../../../core/server/api.js';
import { labelOf } from '../../../core/defects/codes.js';
import { html, render } from '../../../core/page/html.js';
import { loadAsset } from '../../../core/survey/register.js';
import { Component } from '../../../core/page/store.js';
import { chainage, clockHour, count, day, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { defectPath } from '../../find/find-page/find-page.js';
import { pendingNote, showFault } from '../../shared/page-frame/page-frame.js';
import { editAsset } from '../asset-form/asset-form.js';
import '../asset-map/asset-map.js';
import { unitWord } from '../../defects/defect-form/units.js';
import { icon } from '../../shared/icon/icon.js';
import { labelChips } from '../../inspections/labels/labels.js';
import { severityMark } from '../../shared/severity-mark/severity-mark.js';
import { statusChip } from '../../shared/status-chip/status-chip.js';
import { followThumbnails, thumbnail } from '../../shared/thumbnail/thumbnail.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { alsoWritten } from './asset-table.js';
import { registerFacts } from './register-facts.js';

/** Signs of the changes, in the order in which they matter. */
const SIGNS = { new: 'plus', grown: 'alert', gone: 'minus', unchanged: 'check', first: 'flag' };
const CHANGES = Object.keys(SIGNS);
/** Seconds until the server is asked again while it reads inspections in. */
const POLL_S = 10;

export class AssetHistory extends Component {
  #history;
  #change = '';
  /** The answers that are shown, as text: only other ones are rendered, which takes the focus away. */
  #shown = '';
  /** Ends with the question to the server. */
  #asked = new AbortController();

  mount() {
    /** @type {Parts<'assets-page/asset-history'>} */
    this.parts = render(
      this,
      html`<div class="asset__about one-if-narrow stack gap-4 at-top"><div class="asset__facts stack at-start below-3" data-part="facts"></div><asset-map class="asset__map" data-part="map" hidden></asset-map></div>
        <div data-part="pending"></div>
        <div data-part="history"><p class="dim" role="status">${t('page.loading')}</p></div>`,
    );
  }

  /**
   * @param {string} asset
   * @param {{fault: Element, compare: Element, edit: Element}} around parts of the page
   */
  fill(asset, around) {
    followThumbnails(this, this.signal);
    this.listen(this, 'click', ({ target }) => {
      const button = target.closest('[data-change]');
      if (button) this.#choose(button.dataset.change);
    });
    this.listen(around.edit, 'click', () =>
      orToast(async () => {
        if (await editAsset(asset)) this.#ask(asset, around);
      }),
    );
    this.signal.addEventListener('abort', () => this.#asked.abort());
    this.#ask(asset, around);
  }

  /** Asks for all of it, again while inspections are not in the answer yet. */
  #ask(asset, around) {
    this.#asked.abort();
    this.#asked = new AbortController();
    const { signal } = this.#asked;
    const ask = async () => {
      await this.#load(asset, around, signal);
      showFault(around.fault, null);
      return this.#history.pending > 0 ? POLL_S : null;
    };
    return poll(ask, signal, (error) => {
      if (!error.isTemporary) this.parts.history.replaceChildren();
      showFault(around.fault, error);
    });
  }

  async #load(asset, around, signal) {
    const { parts } = this;
    const [history, registered, map] = await Promise.all([
      get(`/api/archive/assets/${encodeURIComponent(asset)}`, signal),
      loadAsset(asset, signal),
      get(`/api/map?${new URLSearchParams({ asset })}`, signal),
    ]);
    const answers = JSON.stringify([history, registered, map]);
    if (answers === this.#shown) return;
    this.#shown = answers;
    this.#history = history;
    render(
      parts.facts,
      html`${projectLinks(history, registered)}${alsoWritten(history.also_written)}${registerFacts(registered)}`,
    );
    parts.map.hidden = map.assets.length === 0;
    if (map.assets.length) parts.map.show(map);
    render(parts.pending, pendingNote(history.pending));
    render(around.compare, compareLink(history.inspections));
    this.#show();
  }

  #choose(change) {
    this.#change = this.#change === change ? '' : change;
    this.#show();
    this.querySelector(`[data-change="${change}"]`).focus();
  }

  #show() {
    const { inspections, traces, total } = this.#history;
    if (inspections.length === 0) {
      render(this.parts.history, html`<p class="panel row gap-3 wrap pad-4">${t('assets.never')}</p>`);
      return;
    }
    const shown = traces.filter(({ change }) => !this.#change || change === this.#change);
    render(
      this.parts.history,
      html`${total > inspections.length && html`<p class="dim">${t('assets.newest', { n: inspections.length, total })}</p>`}
        ${traces.length > 0 && html`<div class="flow below-3" role="group" aria-label="${t('assets.by_change')}">${CHANGES.map((change) => this.#changeButton(change))}</div>`}
        <div class="history-scroll" tabindex="0" role="region" aria-label="${t('assets.history')}"><table class="asset-history">
        <caption class="visually-hidden">${t('assets.history')}</caption>
        <thead><tr><th scope="col">${t('search.defect')}</th>${inspections.map((one, i) =>
          inspectionHead(
            one,
            inspections[i - 1],
            inspections.some(({ has_film: hasFilm }) => hasFilm),
          ),
        )}</tr></thead>
        <tbody>${shown.map((trace) => traceRow(trace, inspections))}</tbody></table></div>
        ${traces.length === 0 && html`<p class="panel row gap-3 wrap pad-4">${inspections.some(({ defects }) => defects.length) ? t('assets.no_places') : t('assets.no_defects')}</p>`}`,
    );
  }

  #changeButton(change) {
    const n = this.#history.traces.filter((trace) => trace.change === change).length;
    return html`<button class="button button--small" data-change="${change}" aria-pressed="${this.#change === change}"
      title="${wordFor('assets.change_help', change)}" ${n === 0 && this.#change !== change && 'disabled'}>${icon(SIGNS[change])}${wordFor('assets.change', change)} <span class="number">${count(n)}</span></button>`;
  }
}

/** The way back to its projects: that of the register, and those of its inspections. */
function projectLinks({ inspections }, registered) {
  const projects = [...new Set([registered?.project, ...inspections.map(({ project }) => project)].filter(Boolean))];
  return html`${projects.length > 0 && html`<p>${t('archive.project')}: ${projects.map((project, i) => html`${i > 0 && ', '}<a href="/assets/projects?${new URLSearchParams({ project })}">${project}</a>`)}</p>`}`;
}

const comparePath = (a, b) => `/compare?${new URLSearchParams({ a: a.id, b: b.id })}`;

function compareLink(inspections) {
  const [a, b] = inspections.slice(-2);
  return html`${b && html`<a class="button" href="${comparePath(a, b)}">${icon('swap')}${t('assets.compare')}</a>`}`;
}

const inspectionHead = (inspection, before, haveFilms) => {
  const {
    id,
    name,
    at,
    status,
    length_m: length,
    length_u95_m: u95M,
    is_useful,
    worst_severity: worst,
    direction,
    defects,
    has_film: hasFilm,
    labels,
  } = inspection;
  return html`<th scope="col">${haveFilms && thumbnail(hasFilm ? id : null)}
    <span class="number">${day(at)}</span><a href="/inspections/${id}">${name}</a>
    <span class="asset-history__facts">${statusChip(status, { distance_u95_m: u95M, is_useful })}${length !== null && html`<span class="number dim">${chainage(length)}</span>`}${worst !== null && severityMark(worst)}<span class="dim">${t('search.found', { n: defects.length, count: count(defects.length) })}</span></span>
    ${direction && html`<span class="dim">${wordFor('header.choice', direction)}</span>`}
    ${labels.length > 0 && html`<span class="asset-history__facts">${labelChips(labels)}</span>`}
    ${summary(inspection)}
    ${before && html`<a href="${comparePath(before, inspection)}">${t('assets.compare_before')}</a>`}</th>`;
};

/** '2 new · 1 gone': what the survey shows, where there was one to compare with. */
function summary({ changes }) {
  const parts = CHANGES.filter((change) => change !== 'first' && changes[change]).map(
    (change) => `${count(changes[change])} ${wordFor('assets.change_of', change)}`,
  );
  return html`${parts.length > 0 && html`<span class="plain number">${parts.join(' · ')}</span>`}`;
}

function traceRow(trace, inspections) {
  const { code, distance_m: m, distance_u95_m: u95, clock, changes, seen } = trace;
  const byInspection = Map.groupBy(seen, ({ inspection_id: id }) => id);
  return html`<tr><th scope="row"><b>${code}</b> ${labelOf(trace)}
      <small class="number">${chainage(m)} ${u95 !== null && plusMinus(u95)}${clock !== null && ` · ${clockHour(clock)}`}</small>
      ${changeChip(trace)}</th>
    ${inspections.map(({ id }, i) => html`<td>${(byInspection.get(id) ?? []).map(sightingMarkup)}${!byInspection.has(id) && notSeen(changes[i])}</td>`)}</tr>`;
}

function changeChip({ change, growth }) {
  const text = change === 'grown' ? growthText(growth) : wordFor('assets.change', change);
  return html`<span class="chip asset-history__change asset-history__change--${change}" title="${wordFor('assets.change_help', change)}">${icon(SIGNS[change])}${text}</span>`;
}

function growthText({ quantity, before, after, unit }) {
  if (quantity === 'severity') return t('assets.grown', { from: before, to: after });
  return t('assets.grown_quantity', { from: before, to: after, unit: unitWord(unit) });
}

const notSeen = (change) =>
  change === 'gone'
    ? html`<span class="asset-history__gone inline-row gap-1 dim">${icon('minus')}${wordFor('assets.change', 'gone')}</span>`
    : html`<span class="dim" title="${t('assets.not_seen')}">–</span>`;

const sightingMarkup = (sighting) =>
  html`<a class="asset-history__seen inline-row plain" href="${defectPath(sighting)}">${severityMark(sighting.severity)}<b>${sighting.severity ?? '–'}</b></a>`;

customElements.define('asset-history', AssetHistory);
