/** The assets that were inspected; with ?asset=NAME the history of one: its defects side by side over the years. */

import { ApiError, get } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { PagedList } from '../../core/paged-list.js';
import { Component } from '../../core/store.js';
import { chainage, clockHour, count, day, plusMinus } from '../../core/units.js';
import { language, t, wordFor } from '../../core/words.js';
import { archivePage, exportButton, pendingNote, showFault } from '../archive-shell/archive-shell.js';
import { defectPath } from '../archive-defects/archive-defects.js';
import '../data-table/data-table.js';
import { icon } from '../icon/icon.js';
import { closesElsewhere } from '../menu/menu.js';
import '../pager/pager.js';
import { severityMark } from '../severity-mark/severity-mark.js';
import { statusChip } from '../status-chip/status-chip.js';
import { orToast } from '../toast-stack/toast-stack.js';

const POLL_S = 10;

class ArchiveAssets extends Component {
  mount() {
    const asset = new URLSearchParams(location.search).get('asset');
    if (asset === null) this.#showAll();
    else this.#showOne(asset);
  }

  #showAll() {
    this.parts = render(
      this,
      archivePage({
        title: t('archive.assets'),
        ways: exportButton(),
        content: html`<search class="find"><div class="field find__text"><label class="visually-hidden" for="assets-text">${t('assets.search')}</label>
            <input class="input" id="assets-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('assets.search')}" data-part="text" /></div></search>
          <div data-part="pending"></div>
          <data-table data-part="table"></data-table>
          <p class="panel find__nothing" data-part="nothing" hidden>${t('assets.nothing')}</p>
          <list-pager data-part="pager"></list-pager>`,
      }),
    );
    const { parts, signal } = this;
    const list = new PagedList('/api/archive/assets', { filters: ['search'], signal });
    parts.text.value = list.filters.search;
    parts.table.fill({ caption: t('archive.assets'), columns: columns(), keyOf: ({ asset }) => asset, list });
    parts.pager.fill(list);
    closesElsewhere(this.querySelector('.export-all'), signal);
    this.listen(parts.text, 'input', () => orToast(() => list.want({ search: parts.text.value })));
    this.listen(list, 'change', () => {
      const { assets, total, pending } = list.value;
      parts.table.show(assets);
      parts.table.hidden = total === 0;
      parts.nothing.hidden = total > 0;
      render(parts.pending, pendingNote(pending));
    });
    list.follow(() => POLL_S, (error) => showFault(parts.fault, error));
  }

  async #showOne(asset) {
    this.parts = render(
      this,
      archivePage({
        title: asset,
        ways: html`<a class="button" href="/archive/assets">${icon('back')}${t('archive.assets')}</a><span data-part="compare"></span>`,
        content: html`<div data-part="pending"></div><div data-part="history"><p class="dim" role="status">${t('page.loading')}</p></div>`,
      }),
    );
    try {
      const history = await get(`/api/archive/assets/${encodeURIComponent(asset)}`, this.signal);
      this.#showHistory(history);
    } catch (error) {
      if (error.name === 'AbortError') return;
      if (!(error instanceof ApiError)) throw error;
      this.parts.history.replaceChildren();
      showFault(this.parts.fault, error);
    }
  }

  #showHistory({ inspections, traces, total, pending }) {
    const { parts } = this;
    render(parts.pending, pendingNote(pending));
    if (inspections.length === 0) {
      render(parts.history, html`<p class="panel find__nothing">${t('assets.never')}</p>`);
      return;
    }
    if (inspections.length > 1) {
      const [a, b] = inspections.slice(-2);
      render(parts.compare, html`<a class="button" href="/compare?${new URLSearchParams({ a: a.id, b: b.id })}">${icon('swap')}${t('assets.compare')}</a>`);
    }
    render(
      parts.history,
      html`${total > inspections.length && html`<p class="dim">${t('assets.newest', { n: inspections.length, total })}</p>`}
        <div class="history-scroll" tabindex="0" role="region" aria-label="${t('assets.history')}"><table class="asset-history">
        <caption class="visually-hidden">${t('assets.history')}</caption>
        <thead><tr><th scope="col">${t('search.defect')}</th>${inspections.map(inspectionHead)}</tr></thead>
        <tbody>${traces.map((trace) => traceRow(trace, inspections))}</tbody></table></div>
        ${traces.length === 0 && html`<p class="panel find__nothing">${inspections.some(({ defects }) => defects.length) ? t('assets.no_places') : t('assets.no_defects')}</p>`}`,
    );
  }
}

const inspectionHead = ({ id, name, at, status, length_m: length, worst_severity: worst, direction, defects }) => html`<th scope="col">
  <span class="number">${day(at)}</span><a href="/inspections/${id}">${name}</a>
  <span class="asset-history__facts">${statusChip(status)}${length !== null && html`<span class="number dim">${chainage(length)}</span>`}${worst !== null && severityMark(worst)}<span class="dim">${t('search.found', { n: defects.length, count: count(defects.length) })}</span></span>
  ${direction && html`<span class="dim">${wordFor('header.choice', direction)}</span>`}</th>`;

function traceRow(trace, inspections) {
  const { code, label, label_ms: malay, distance_m: m, distance_u95_m: u95, clock, has_grown: hasGrown, seen } = trace;
  const byInspection = Map.groupBy(seen, ({ inspection_id: id }) => id);
  return html`<tr><th scope="row"><b>${code}</b> ${language === 'ms' && malay ? malay : label}
      <small class="number">${chainage(m)} ${u95 !== null && plusMinus(u95)}${clock !== null && ` · ${clockHour(clock)}`}</small>
      ${hasGrown && html`<span class="chip asset-history__grown">${icon('alert')}${t('assets.grown', { from: trace.first_severity, to: trace.last_severity })}</span>`}</th>
    ${inspections.map(({ id }) => html`<td>${(byInspection.get(id) ?? []).map(sightingMarkup)}${!byInspection.has(id) && html`<span class="dim" title="${t('assets.not_seen')}">–</span>`}</td>`)}</tr>`;
}

const sightingMarkup = (sighting) => html`<a class="asset-history__seen" href="${defectPath(sighting)}">${severityMark(sighting.severity)}<b>${sighting.severity ?? '–'}</b></a>`;

const columns = () => [
  { name: 'asset', title: t('archive.asset'), cell: ({ asset }) => html`<a href="/archive/assets?${new URLSearchParams({ asset })}">${asset}</a>` },
  { name: 'project', title: t('archive.project'), cell: ({ project }) => html`${project ?? '–'}` },
  { name: 'inspections', title: t('assets.inspections'), cell: ({ inspections }) => html`<span class="number">${inspections}</span>` },
  { name: 'last', title: t('assets.last'), cell: ({ last_at: at }) => html`<span class="number">${day(at)}</span>` },
  {
    name: 'worst',
    title: t('list.worst'),
    cell: ({ worst_severity: worst }) => (worst === null ? html`<span class="dim">–</span>` : html`<span class="inspection__worst">${severityMark(worst)}<b>${worst}</b> <span class="dim">${wordFor('severity', String(worst))}</span></span>`),
  },
];

customElements.define('archive-assets', ArchiveAssets);
