/** The start page: the sections to inspect, and what is live, waits for a reviewer, or has ended. */

import { html, render, renderNew } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { chainage, count, day, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { assetPath } from '../../assets/assets-page/asset-table.js';
import { sectionOf } from '../../assets/register-page/register-page.js';
import { column, figures } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { followList, searchMarkup, tableMarkup } from '../../shared/page-frame/list-page.js';
import { framedPage, likeButton } from '../../shared/page-frame/page-frame.js';
import { GRAVEST, worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { reviewChip, statusChip } from '../../shared/status-chip/status-chip.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { endOrder, importOrders } from './orders.js';
import './sample-button.js';

const POLL_S = 5;

/** States of a section in the order of the job, each with its sign and the chip that it looks like. */
const STATES = {
  to_do: ['flag', 'queued'],
  live: ['live', 'running'],
  recorded: ['video', 'draft'],
  in_review: ['search', 'in_review'],
  issued: ['check', 'approved'],
};

export class WorkPage extends Component {
  mount() {
    /** @type {Parts<'work-page/work-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('work.title'),
        ways: html`<button class="button" data-needs="operator" data-part="orders">${icon('upload')}${t('orders.import')}</button>
          <input type="file" accept=".csv,.txt,.tsv,text/csv" aria-label="${t('orders.import')}" data-part="file" hidden />
          <a class="button" href="/assets/register" data-needs="operator">${icon('upload')}${t('work.import')}</a>
          <a class="button button--primary" href="/new" data-needs="operator">${icon('plus')}${t('list.new')}</a>`,
        content: html`<div class="work">
          <section aria-labelledby="work-sections">
            <h2 class="visually-hidden" id="work-sections">${t('work.sections')}</h2>
            <div class="choices flow gap-1 pad-1 work__states" role="group" aria-label="${t('work.by_state')}" data-part="states"></div>
            ${searchMarkup(t('work.search'), filterButtons())}${tableMarkup('work__table', '')}
          </section>
          <div class="work__around stack packed" data-part="around"></div>
        </div>`,
      }),
    );
    const { states } = this.parts;
    const list = followList(this, {
      path: '/api/work',
      filters: ['search', 'state', 'project', 'orders'],
      rows: 'sections',
      caption: t('work.sections'),
      columns: columns(),
      keyOf: ({ asset }) => asset,
      usual: { sort: 'state', descending: 'false' },
      chosen: ({ project, orders }) => [
        ['project', t('archive.project'), project],
        ['orders', t('orders.title'), orders && wordFor('orders.filter', orders)],
      ],
      show: (answer) => this.#show(answer, list),
      pauseAfter: () => POLL_S,
    });
    this.listen(states, 'click', ({ target }) => {
      const button = target.closest('[data-state]');
      if (button) orToast(() => list.want({ state: button.dataset.state }));
    });
    const { orders, file } = this.parts;
    this.listen(orders, 'click', () => file.click());
    this.listen(file, 'change', async () => {
      const [chosen] = file.files;
      file.value = ''; // so that the repaired file can be chosen again
      if (chosen && (await importOrders(chosen))) await orToast(() => list.again());
    });
    this.listen(this, 'click', ({ target }) => {
      const { end, number } = target.closest('[data-end]')?.dataset ?? {};
      if (end) orToast(async () => (await endOrder(end, number)) && list.again());
    });
  }

  #show({ states, live, review, past }, { filters, isFiltered }) {
    const { parts } = this;
    const all = Object.values(states).reduce((sum, n) => sum + n, 0);
    parts.states.hidden = all === 0;
    const focused = document.activeElement?.closest('[data-state]')?.dataset.state;
    renderNew(
      parts.states,
      html`${stateButton('', t('work.all'), all, filters.state)}${Object.keys(STATES).map((state) =>
        stateButton(state, wordFor('work_state', state), states[state], filters.state),
      )}`,
    );
    parts.states.querySelector(`[data-state="${focused}"]`)?.focus();
    renderNew(parts.nothing, isFiltered ? html`<p>${t('work.nothing')}</p>` : emptyMarkup());
    renderNew(
      parts.around,
      html`${card('live', live, '/inspections?status=running')}${card('review', review, '/inspections?review=submitted')}${card('past', past, '/inspections')}`,
    );
  }
}

const filterButtons = () =>
  html`${['open', 'overdue'].map(
    (which) =>
      html`<button class="button button--small" data-filter="orders" data-value="${which}">${wordFor('orders.filter', which)}</button>`,
  )}`;

const stateButton = (state, name, n, chosen) =>
  html`<button class="button button--small" data-state="${state}" aria-pressed="${String(state === chosen)}">
    ${state && icon(STATES[state][0])}${name} <b class="number">${count(n)}</b></button>`;

const emptyMarkup = () => html`<div class="stack gap-3 at-start"><h2>${t('work.empty')}</h2>
  <p class="dim">${t('work.empty_text')}</p>
  <div class="flow gap-3" data-needs="operator">
    <a class="button button--primary" href="/assets/register">${icon('upload')}${t('work.import')}</a>
    <a class="button" href="/new">${icon('plus')}${t('list.new')}</a>
    <sample-button></sample-button>
  </div></div>`;

/** Some inspections beside the list, and the way to all of their kind. */
const card = (
  kind,
  { total, inspections },
  all,
) => html`<section class="work__card--${total ? kind : 'none'} panel stack pad-4 packed" aria-labelledby="work-${kind}">
  <h2 class="row apart" id="work-${kind}"><span>${wordFor('work_card', kind)}</span><span class="number">${count(total)}</span></h2>
  ${total === 0 && html`<p class="dim small">${wordFor('work_none', kind)}</p>`}
  ${total > 0 && html`<ul class="stack">${inspections.map(briefMarkup)}</ul>`}
  ${total > inspections.length && html`<a href="${all}">${t('work.show_all', { n: total, count: count(total) })}</a>`}
</section>`;

function briefMarkup(inspection) {
  const { id, name, status, review_state: review, created_at: at, worst_severity: worst } = inspection;
  return html`<li class="work__brief">
    <a class="one-line" href="/inspections/${id}">${name}</a>${worst === GRAVEST && worstMarkup(worst)}
    <span class="small dim one-line number">${day(at)}</span>
    ${review === 'draft' ? statusChip(status, inspection) : reviewChip(review)}</li>`;
}

const columns = () => [
  column(
    'section',
    t('work.section'),
    ({ asset, header: { road, location_text: where, start_node: from, end_node: to } }) =>
      html`<a class="strong" href="${assetPath(asset)}">${asset}</a><small>${[from && to && `${from} – ${to}`, road, where].filter(Boolean).join(' · ')}</small>`,
    'asset',
  ),
  column('pipe', t('work.pipe'), ({ header }) => html`${sectionOf(header)}<small>${lengthOf(header)}</small>`),
  column('project', t('archive.project'), ({ project }) => likeButton('project', project), 'project'),
  column('state', t('list.status'), stateMarkup, 'state'),
  column('order', t('orders.title'), orderMarkup, 'due_on'),
  figures('last', t('assets.last'), ({ last_at: at }) => at && day(at), 'last_on'),
  figures('worst', t('list.worst'), ({ worst_severity: worst }) => worstMarkup(worst), 'worst_severity'),
  column('start', html`<span class="visually-hidden">${t('work.start')}</span>`, startMarkup),
];

const lengthOf = ({ material, known_length_m: known, expected_length_m: expected }) =>
  [material, (known ?? expected) && chainage(known ?? expected)].filter(Boolean).join(' · ');

/** How far a section is, with the way to the inspection that says so; amber where its distances are of no use. */
function stateMarkup({ state, inspection_id: id, is_useful: isUseful, distance_u95_m: u95M }) {
  const [sign, look] = isUseful === false ? ['alert', 'useless'] : STATES[state];
  const chip = html`<span class="chip chip--${look}" title="${isUseful === false && t('fitness.useless')}">${icon(sign)}<span>${wordFor('work_state', state)}
    ${isUseful === false && html`<span class="number">${plusMinus(u95M)}</span>`}</span></span>`;
  return id === null ? chip : html`<a class="plain" href="/inspections/${id}">${chip}</a>`;
}

/** Why and until when a section is to be inspected. */
function orderMarkup({ order }) {
  if (!order) return '';
  const { id, number, reason, due_on: due, is_overdue: isOverdue } = order;
  return html`<span class="row gap-1"><b>${number}</b>${
    may('operator') &&
    html`<button class="button button--small button--quiet button--icon" data-end="${id}" data-number="${number}"
      aria-label="${t('orders.end_named', { number })}" title="${t('orders.end_named', { number })}">${icon('close')}</button>`
  }</span>
    ${due && (isOverdue ? html`<span class="chip chip--failed">${icon('alert')}<span class="visually-hidden">${t('orders.overdue')}</span>${day(due)}</span>` : html`<small>${t('orders.due', { day: day(due) })}</small>`)}
    ${reason && html`<small class="breaks">${reason}</small>`}`;
}

function startMarkup({ asset, state, inspection_id: id, order }) {
  if (state === 'live')
    return html`<a class="button button--small button--primary" href="/inspections/${id}">${icon('live')}${t('work.watch')}</a>`;
  return html`<a class="button button--small ${state === 'to_do' && 'button--primary'}" data-needs="operator"
    href="/new?${new URLSearchParams(order ? { asset, order: order.number } : { asset })}" aria-label="${t('work.start_named', { asset })}">${icon('plus')}${t('work.begin')}</a>`;
}

customElements.define('work-page', WorkPage);
