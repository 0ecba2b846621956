/** The films of the archive: what becomes of each, and what is done with many at once. */

import {
  ACTS_ON,
  FILTERS,
  act,
  change,
  concerned,
  progressOf,
  takeOff,
  undoOf,
  whereOf,
} from '../../../core/survey/archive.js';
import { poll } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { bindKeys, withKey } from '../../../core/page/keys.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { may } from '../../../core/page/rights.js';
import { Selection } from '../../../core/defects/selection.js';
import { Component } from '../../../core/page/store.js';
import { bytes, chainage, count, signed } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { archivePage, filterChips, followFilters, likeButton, showFault } from '../archive-shell/archive-shell.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { pace } from '../inspection-list/row.js';
import { showKeys } from '../../desk/actions/key-help.js';
import '../../shared/pager/pager.js';
import { FILM_STATES, outdatedFilter, statusChip } from '../../shared/status-chip/status-chip.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { askChange, askCancel, askTakeOff } from './dialogs.js';
import { emptyArchive } from './empty.js';
import { progressMarkup } from './progress.js';

const BUSY_S = 2;
const IDLE_S = 5;

/** The buttons: name, sign. @type {[import('../../../core/survey/archive.js').Action, import('../../shared/icon/icon.js').IconName][]} */
const ACTIONS = [
  ['start', 'play'],
  ['pause', 'pause'],
  ['resume', 'forward'],
  ['retry', 'retry'],
  ['cancel', 'stop'],
];

const UNDER_WAY = ['waiting', 'queued', 'running'];

export class ArchiveFilms extends Component {
  #list;
  /** @type {Selection<Api['app__web__schemas__archive__FilmOut']>} */
  #selection = new Selection();
  #states = {};

  mount() {
    /** @type {Parts<'archive-films/archive-films'>} */
    this.parts = render(
      this,
      archivePage({
        title: t('archive.films'),
        ways: html`<button class="button button--quiet" data-part="keys">${icon('keys')}${t('archive.keys')} <kbd>?</kbd></button>
          <a class="button ${may('admin') && 'button--primary'}" href="/archive/add" data-needs="operator" ${!may('admin') && html`title="${t('rights.admin')}"`}>${icon('plus')}${t('archive.add')}</a>`,
        content: html`<section class="panel archive-progress stack pad-head below-4" data-part="progress" aria-label="${t('archive.progress')}" hidden></section>
          <section class="panel empty stack gap-4 at-start" data-part="empty" hidden>${emptyArchive()}</section>
          <div data-part="body" hidden>
            <search class="row gap-3 wrap below-4">
              <div class="field find__text"><label class="visually-hidden" for="films-text">${t('archive.search')}</label>
                <input class="input" id="films-text" type="search" autocomplete="off" placeholder="${t('archive.search_hint')}" data-part="text" /></div>
              <div class="field"><label class="visually-hidden" for="films-state">${t('list.filter')}</label>
                <select class="input" id="films-state" data-part="state"><option value="">${t('list.all')}</option>
                  ${FILM_STATES.map((state) => html`<option value="${state}">${wordFor('status', state)}</option>`)}</select></div>
              <span class="find__filters" data-part="chips"></span>
            </search>
            <div class="film-actions row wrap" role="toolbar" aria-label="${t('archive.actions')}" data-needs="operator" data-part="toolbar">
              <p class="number film-actions__chosen" role="status" data-part="chosen"></p>
              <button class="button button--small" data-part="all"></button>
              <button class="button button--small button--quiet" data-part="none">${t('archive.select_none')}</button>
              <span class="film-actions__buttons flow">${ACTIONS.map(([name, sign]) => html`<button class="button button--small" data-action="${name}">${icon(sign)}${wordFor('archive_action', name)}</button>`)}
                <button class="button button--small" data-part="change">${icon('edit')}${t('archive.change')}</button>
                <button class="button button--small" data-part="takeOff">${icon('trash')}${t('archive.take_off')}</button></span>
            </div>
            <data-table class="films-table" data-part="table"></data-table>
            <p class="panel find__nothing row gap-3 wrap pad-4" data-part="nothing" hidden>${t('archive.nothing')}
              <button class="button button--small" data-part="clear">${t('list.clear')}</button></p>
            <list-pager data-part="pager"></list-pager>
          </div>`,
      }),
    );
    const { parts, signal } = this;
    const list = new PagedList('/api/archive/films', { filters: [...FILTERS, 'sort', 'descending'], signal });
    this.#list = list;
    parts.text.value = list.filters.search;
    parts.state.value = list.filters.state;
    parts.table.fill({ caption: t('archive.films'), columns: columns(), keyOf: ({ id }) => id, list });
    parts.pager.fill(list);
    const find = () => orToast(() => list.want({ search: parts.text.value, state: parts.state.value }));
    this.listen(parts.text, 'input', find);
    this.listen(parts.state, 'change', find);
    this.listen(parts.clear, 'click', () => {
      parts.text.value = '';
      parts.state.value = '';
      orToast(() => list.want(Object.fromEntries(FILTERS.map((name) => [name, '']))));
      parts.text.focus();
    });
    followFilters(this, list, signal, orToast);
    this.listen(list, 'change', () => this.#show());
    this.#selects();
    this.#listensForActions();
    this.#bindsKeys();
    list.follow(
      () => (UNDER_WAY.some((state) => this.#states[state]) ? BUSY_S : IDLE_S),
      (error) => showFault(parts.fault, error),
    );
    poll(
      () => this.#loadProgress(),
      signal,
      (error) => showFault(parts.fault, error),
    );
  }

  async #loadProgress() {
    const progress = await progressOf(this.signal);
    this.#states = progress.states;
    const { parts } = this;
    const all = Object.values(progress.states).reduce((sum, n) => sum + n, 0);
    parts.empty.hidden = all > 0;
    parts.body.hidden = all === 0;
    parts.progress.hidden = all === 0;
    const markup = progressMarkup(progress, all);
    if (markup.text !== this.progressText) {
      this.progressText = markup.text;
      const focused = document.activeElement?.dataset?.go;
      render(parts.progress, markup);
      if (focused !== undefined) parts.progress.querySelector(`[data-go="${focused}"]`)?.focus();
    }
    return UNDER_WAY.some((state) => progress.states[state]) ? BUSY_S : IDLE_S;
  }

  #show() {
    const { parts } = this;
    const { films, total } = this.#list.value;
    const { filters } = this.#list;
    parts.table.show(films);
    parts.table.hidden = total === 0;
    parts.nothing.hidden = total > 0;
    parts.state.value = filters.state;
    const chosen = [
      ['project', t('archive.project'), filters.project],
      ['asset', t('archive.asset'), filters.asset],
      ['reason', t('archive.reason'), filters.reason],
      ['outdated', t('list.status'), filters.outdated && t('outdated.word')],
    ].filter(([, , value]) => value);
    render(parts.chips, filterChips(chosen));
    this.#showSelection();
  }

  // Selection

  #selects() {
    const { parts } = this;
    const selection = this.#selection;
    const where = () => JSON.stringify(whereOf(this.#list.filters));
    let shown = where();
    this.listen(this.#list, 'change', () => {
      // "All that fit" would silently become other films.
      if (selection.isAll && where() !== shown) selection.clear();
      shown = where();
    });
    this.listen(parts.table, 'click', ({ target, shiftKey }) => {
      const films = this.#list.value?.films ?? [];
      const { checked: isSelected } = target;
      if (target.matches('[data-mark-page]')) selection.mark(films, isSelected);
      else if (target.matches('[data-mark]'))
        selection.markOne(films, target.dataset.mark, { isSelected, isRange: shiftKey });
    });
    this.listen(parts.all, 'click', () => selection.markAll(whereOf(this.#list.filters), this.#list.total));
    this.listen(parts.none, 'click', () => selection.clear());
    this.listen(selection, 'change', () => this.#showSelection());
  }

  #showSelection() {
    if (!may('operator')) return;
    const { parts } = this;
    const selection = this.#selection;
    for (const box of parts.table.querySelectorAll('[data-mark]')) box.checked = selection.has(box.dataset.mark);
    const films = this.#list.value?.films ?? [];
    const onPage = films.filter(({ id }) => selection.has(id)).length;
    const head = parts.table.querySelector('[data-mark-page]');
    head.checked = films.length > 0 && onPage === films.length;
    head.indeterminate = onPage > 0 && onPage < films.length;
    setText(
      parts.chosen,
      selection.size
        ? t('archive.chosen', { n: selection.size, count: count(selection.size) })
        : t('archive.chosen_none'),
    );
    setText(parts.all, t('archive.select_all', { n: this.#list.total, count: count(this.#list.total) }));
    parts.all.hidden = selection.isAll || this.#list.total === 0;
    parts.none.hidden = selection.size === 0;
    for (const button of parts.toolbar.querySelectorAll('[data-action]')) {
      button.disabled = !this.#concerns(button.dataset.action);
    }
    parts.change.disabled = selection.size === 0;
    parts.takeOff.disabled = selection.size === 0;
  }

  /** Whether the action would change anything; of films on other pages nothing is known. */
  #concerns(action) {
    const selection = this.#selection;
    if (selection.isAll) {
      const { state, outdated } = selection.meant.where;
      if (action === 'retry' && outdated) return true;
      return ACTS_ON[action].some((other) => (state ? other === state : this.#states[other]));
    }
    return concerned(action, selection.items).length > 0;
  }

  // Actions

  #listensForActions() {
    const { parts } = this;
    this.listen(parts.toolbar, 'click', ({ target }) => {
      const button = target.closest('[data-action]');
      if (button) orToast(() => this.#act(button.dataset.action));
    });
    this.listen(parts.progress, 'click', ({ target }) => {
      const state = target.closest('[data-go]')?.dataset.go;
      if (state !== undefined)
        orToast(() => this.#list.want({ state: this.#list.filters.state === state ? '' : state }));
      if (target.closest('[data-start-all]')) orToast(() => this.#startAll());
    });
    this.listen(parts.change, 'click', () => orToast(() => this.#change()));
    this.listen(parts.takeOff, 'click', () => orToast(() => this.#takeOff()));
  }

  async #act(action) {
    const { meant, items: films, isAll, size } = this.#selection;
    const undo = isAll ? null : undoOf(action, films);
    if (action === 'cancel' && !undo && !(await askCancel(isAll ? size : concerned('cancel', films).length))) return;
    await this.#done(action, await act(action, meant), undo);
  }

  async #startAll() {
    await this.#done('start', await act('start', { where: { state: 'ready' } }), null);
  }

  #done(action, n, undo) {
    const sentence = {
      start: (values) => t('archive.done_start', values),
      pause: (values) => t('archive.done_pause', values),
      resume: (values) => t('archive.done_resume', values),
      cancel: (values) => t('archive.done_cancel', values),
      retry: (values) => t('archive.done_retry', values),
    }[action];
    return this.#announce(sentence({ n, count: count(n) }), undo);
  }

  /** Says what was done, with a way back where there is one. */
  #announce(text, undo) {
    this.#selection.clear();
    toast(text, undo && { action: t('page.undo'), run: () => orToast(async () => (await undo(), this.#reload())) });
    return this.#reload();
  }

  async #change() {
    const { meant, items: films, isAll, size } = this.#selection;
    const wanted = await askChange(size, this.signal);
    if (!wanted) return;
    const n = await change(meant, wanted);
    const before = isAll || wanted.rig_name ? null : films;
    const undo =
      before &&
      (async () => {
        for (const film of before) {
          const set = Object.fromEntries(
            Object.keys(wanted)
              .map((name) => [name, film[name]])
              .filter(([, value]) => value !== null),
          );
          await change({ ids: [film.id] }, set);
        }
      });
    const canUndo = before?.every((film) => Object.keys(wanted).every((name) => film[name] !== null));
    await this.#announce(t('archive.done_change', { n, count: count(n) }), canUndo ? undo : null);
  }

  async #takeOff() {
    const { meant, size } = this.#selection;
    if (!(await askTakeOff(size))) return;
    const n = await takeOff(meant);
    await this.#announce(t('archive.done_take_off', { n, count: count(n) }), null);
  }

  async #reload() {
    await this.#list.again();
    await this.#loadProgress();
  }

  #bindsKeys() {
    const { parts } = this;
    const turn = (button) => () => parts.pager.querySelector(`[data-part=${button}]`).click();
    const bindings = [
      { keys: ['/'], label: t('archive.search'), run: () => parts.text.focus() },
      { keys: ['n'], label: t('pager.next'), run: turn('next') },
      { keys: ['p'], label: t('pager.previous'), run: turn('previous') },
      ...(may('operator')
        ? [
            {
              keys: ['a'],
              label: t('archive.select_page'),
              run: () => this.#selection.mark(this.#list.value?.films ?? [], true),
            },
          ]
        : []),
    ];
    const shown = [
      {
        title: t('archive.films'),
        bindings: [...bindings, { keys: ['ArrowUp', 'ArrowDown'], shown: ['↑', '↓'], label: t('table.rows') }],
      },
    ];
    const help = () => showKeys(shown, { hasStage: false });
    bindKeys(document, [...bindings, { keys: ['?'], label: t('keys.list'), run: help }], this.signal);
    this.listen(parts.keys, 'click', help);
    parts.text.title = withKey(t('archive.search'), '/');
  }
}

const dim = (text) => html`<small>${text}</small>`;

const columns = () => [
  ...(may('operator')
    ? [
        {
          name: 'mark',
          title: html`<label><span class="visually-hidden">${t('archive.select_page')}</span><input type="checkbox" data-mark-page /></label>`,
          cell: ({ id, name }) =>
            html`<label><span class="visually-hidden">${t('archive.select', { name })}</span><input type="checkbox" data-mark="${id}" /></label>`,
        },
      ]
    : []),
  {
    name: 'film',
    title: t('archive.film'),
    sort: 'name',
    cell: ({ name, path, size, inspection_id: inspection }) =>
      html`${inspection ? html`<a href="/inspections/${inspection}">${name}</a>` : html`<b>${name}</b>`}<small title="${path}">${path} · ${bytes(size)}</small>`,
  },
  {
    name: 'project',
    title: t('archive.project'),
    sort: 'project',
    cell: ({ project }) => likeButton('project', project),
  },
  { name: 'asset', title: t('archive.asset'), sort: 'asset', cell: ({ asset }) => likeButton('asset', asset) },
  {
    name: 'rig',
    title: t('archive.rig'),
    sort: 'rig_name',
    cell: ({ has_rig: hasRig, rig_name: rig, rule }) =>
      html`${hasRig ? (rig ?? t('archive.rig_own')) : html`<span class="dim">${t('archive.rig_none')}</span>`}${rule && dim(t('archive.by_rule', { rule }))}`,
  },
  { name: 'state', title: t('list.status'), sort: 'state', cell: stateMarkup },
  {
    name: 'priority',
    title: t('archive.priority'),
    sort: 'priority',
    descends: true,
    cell: ({ priority }) => html`<span class="number">${signed(priority, 0)}</span>`,
  },
  {
    name: 'length',
    title: t('list.length'),
    sort: 'distance_m',
    descends: true,
    cell: ({ distance_m: m }) => html`<b class="number">${m === null ? '–' : chainage(m)}</b>`,
  },
];

function stateMarkup(film) {
  const { state, error, frames_done: done, frames_total: total } = film;
  return html`${statusChip(state)} ${outdatedFilter(film.outdated)}
    ${
      state === 'running' &&
      html`<span class="inspection__progress stack full small"><progress class="bar" max="1" value="${total ? done / total : 0}" aria-label="${t('progress.label')}"></progress>
      <span class="dim number">${pace(film)}</span></span>`
    }
    ${error && html`<small class="films-table__reason" title="${errorText(error)}">${errorText(error)}</small>`}`;
}

customElements.define('archive-films', ArchiveFilms);
