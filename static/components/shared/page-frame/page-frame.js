/** What most pages have in common: the way between them, the head, a fault, an empty state. */

import { html, render } from '../../../core/page/html.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';
import { message } from '../message/message.js';
import { orToast } from '../toast-stack/toast-stack.js';
import { partsBar, topBar } from '../top-bar/top-bar.js';

/**
 * @param {object} options
 * @param {string} options.title
 * @param {ReturnType<typeof html>} [options.ways] buttons beside the title
 * @param {ReturnType<typeof html>} options.content
 */
export function framedPage({ title, ways, content }) {
  document.title = `${title} · Chainage`;
  return html`${topBar()}${partsBar()}
    <main id="main" class="content content--broad" tabindex="-1">
      <div class="content__head"><h1>${title}</h1><div class="content__ways">${ways}</div></div>
      <div role="alert" data-part="fault"></div>
      ${content}
    </main>`;
}

/**
 * Shows why the server does not answer; null removes it.
 * @param {HTMLElement} element
 * @param {import('../../../core/server/api.js').ApiError|null} error
 * @param {{isAskedAgain?: boolean}} [options] false: after a request that is not repeated by itself
 */
export function showFault(element, error, { isAskedAgain = true } = {}) {
  if (!error) return render(element, html``);
  const reason = errorText(error);
  const text = isAskedAgain && error.isTemporary ? t('page.trying_again', { reason }) : reason;
  return render(element, message('error', text));
}

/**
 * Says that somebody else has saved meanwhile, and offers both versions; nothing is lost until one is chosen.
 * @param {HTMLElement} element
 * @param {string} text
 * @param {{theirs: () => void, mine: () => Promise<void>}} ways
 */
export function showOvertaken(element, text, { theirs, mine }) {
  const parts = render(
    element,
    html`<div class="message message--warning">${icon('alert')}<span>${text}
      <span class="flow"><button class="button button--small" data-part="theirs">${t('conflict.theirs_take')}</button>
      <button class="button button--small" data-part="mine">${t('conflict.mine_keep')}</button></span></span></div>`,
  );
  parts.theirs.addEventListener('click', theirs);
  parts.mine.addEventListener('click', () => orToast(mine));
  parts.theirs.focus();
}

/** A value that narrows a list to its like, by a filter of the list. */
export const likeButton = (filter, value) =>
  value === null
    ? html`<span class="dim">–</span>`
    : html`<button class="table__like" data-filter="${filter}" data-value="${value}" title="${t('archive.only', { value })}">${value}</button>`;

/** The filters that were set by such a value, each with a way to remove it. */
export const filterChips = (filters) =>
  html`${filters.map(
    ([name, title, value]) => html`<button class="button button--small filter-chip" data-unfilter="${name}"
    title="${t('archive.remove_filter')}">${title}: <b>${value}</b>${icon('close')}</button>`,
  )}`;

/** Narrows a list by a click on a value, and widens it by one on its chip. */
export function followFilters(element, list, signal, onError) {
  element.addEventListener(
    'click',
    ({ target }) => {
      const { filter, value } = target.closest('[data-filter]')?.dataset ?? {};
      const { unfilter } = target.closest('[data-unfilter]')?.dataset ?? {};
      if (filter) onError(() => list.want({ [filter]: value }));
      if (unfilter) onError(() => list.want({ [unfilter]: '' }));
    },
    { signal },
  );
}

/** Says that some inspections are not in the answer yet. */
export const pendingNote = (n) =>
  html`${n > 0 && html`<p class="message">${icon('wait')}<span>${t('search.pending', { n })}</span></p>`}`;

/** Facts side by side: [name, value]. */
export const factsMarkup = (facts) =>
  html`<dl class="facts flow">${facts.map(([name, value]) => html`<div><dt>${name}</dt><dd class="number">${value}</dd></div>`)}</dl>`;

/** The way to everything, for other programs. */
export const exportButton =
  () => html`<details class="menu holds export-all"><summary class="button">${icon('download')}${t('archive.export')}</summary>
  <div class="menu__list panel"><p class="help pad-row">${t('archive.export_help')}</p>
    ${[
      ['parquet', 'Parquet'],
      ['json', 'JSON'],
    ].map(
      ([format, name]) => html`<a class="menu__item" href="/api/archive/export?format=${format}" download>${name}</a>
        <a class="menu__item" href="/api/archive/export?format=${format}&tracks=1" download>${t('archive.export_tracks', { name })}</a>`,
    )}</div></details>`;
