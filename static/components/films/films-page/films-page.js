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
import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { withKey } from '../../../core/page/keys.js';
import { may } from '../../../core/page/rights.js';
import { Selection } from '../../../core/defects/selection.js';
import { Component } from '../../../core/page/store.js';
import { bytes, chainage, count, signed } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { framedPage, likeButton, showFault } from '../../shared/page-frame/page-frame.js';
import {
  bindListKeys,
  clearFilters,
  followList,
  searchMarkup,
  tableMarkup,
} from '../../shared/page-frame/list-page.js';
import { selectRows, showSelected } from '../../shared/page-frame/selecting.js';
import { column, figures } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { pace } from '../../inspections/inspection-list/row.js';
import { FILM_STATES, outdatedFilter, statusChip } from '../../shared/status-chip/status-chip.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { askChange, askCancel, askTakeOff } from './dialogs.js';
import { emptyIntake } from './empty.js';
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

export class FilmsPage extends Component {
  #list;
  /** @type {Selection<Api['app__web__schemas__library__archive__FilmOut']>} */
  #selection = new Selection();
  #states = {};

  mount() {
    /** @type {Parts<'films-page/films-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.films'),
        ways: html`<button class="button button--quiet" data-part="keys">${icon('keys')}${t('archive.keys')} <kbd>?</kbd></button>
          <a class="button ${may('admin') && 'button--primary'}" href="/films/add" data-needs="operator" ${!may('admin') && html`title="${t('rights.admin')}"`}>${icon('plus')}${t('archive.add')}</a>`,
        content: html`<section class="panel archive-progress one-if-narrow stack pad-head below-4" data-part="progress" aria-label="${t('archive.progress')}" hidden></section>
          <section class="panel empty stack gap-4 at-start" data-part="empty" hidden>${emptyIntake()}</section>
          <div data-part="body" hidden>
            ${searchMarkup(
              t('archive.search_hint'),
              html`<div class="field"><label class="visually-hidden" for="films-state">${t('list.filter')}</label>
                <select class="input" id="films-state" data-part="state"><option value="">${t('list.all')}</option>
                  ${FILM_STATES.map((state) => html`<option value="${state}">${wordFor('status', state)}</option>`)}</select></div>`,
            )}
            <div class="film-actions row wrap" role="toolbar" aria-label="${t('archive.actions')}" data-needs="operator" data-part="toolbar">
              <p class="number film-actions__chosen" role="status" data-part="chosen"></p>
              <button class="button button--small" data-part="all"></button>
              <button class="button button--small button--quiet" data-part="none">${t('archive.select_none')}</button>
              <span class="film-actions__buttons flow">${ACTIONS.map(([name, sign]) => html`<button class="button button--small" data-action="${name}">${icon(sign)}${wordFor('archive_action', name)}</button>`)}
                <button class="button button--small" data-part="change">${icon('edit')}${t('archive.change')}</button>
                <button class="button button--small" data-part="takeOff">${icon('trash')}${t('archive.take_off')}</button></span>
            </div>
            ${tableMarkup(
              'films-table',
              html`<p>${t('archive.nothing')} <button class="button button--small" data-part="clear">${t('list.clear')}</button></p>`,
            )}
          </div>`,
      }),
    );
    const { parts, signal } = this;
    const list = followList(this, {
      path: '/api/archive/films',
      filters: FILTERS,
      rows: 'films',
      caption: t('archive.films'),
      columns: columns(),
      keyOf: ({ id }) => id,
      chosen: ({ project, asset, reason, outdated }) => [
        ['project', t('archive.project'), project],
        ['asset', t('archive.asset'), asset],
        ['reason', t('archive.reason'), reason],
        ['outdated', t('list.status'), outdated && t('outdated.word')],
      ],
      show: (_, { filters }) => {
        parts.state.value = filters.state;
        this.#showSelection();
      },
      pauseAfter: () => this.#pauseS,
    });
    this.#list = list;
    parts.state.value = list.filters.state;
    this.listen(parts.state, 'change', () => orToast(() => list.want({ state: parts.state.value })));
    this.listen(parts.clear, 'click', () => {
      parts.text.value = '';
      clearFilters(this, list, FILTERS);
    });
    selectRows(this, this.#selecting);
    this.listen(this.#selection, 'change', () => this.#showSelection());
    this.#listensForActions();
    this.#bindsKeys();
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
    const focused = document.activeElement?.dataset?.go;
    renderNew(parts.progress, progressMarkup(progress, all));
    if (focused !== undefined) parts.progress.querySelector(`[data-go="${focused}"]`)?.focus();
    return this.#pauseS;
  }

  get #pauseS() {
    return UNDER_WAY.some((state) => this.#states[state]) ? BUSY_S : IDLE_S;
  }

  // Selection

  get #selecting() {
    return {
      selection: this.#selection,
      list: this.#list,
      boxes: this.parts.table,
      rows: () => this.#list.value?.films ?? [],
      where: () => whereOf(this.#list.filters),
    };
  }

  #showSelection() {
    if (!may('operator')) return;
    const { parts } = this;
    const selection = this.#selection;
    showSelected(parts, this.#selecting);
    setText(
      parts.chosen,
      selection.size
        ? t('archive.chosen', { n: selection.size, count: count(selection.size) })
        : t('archive.chosen_none'),
    );
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
    return this.#announce(wordFor('archive_done', action, { n, count: count(n) }), undo);
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
    const selectPage = {
      keys: ['a'],
      label: t('archive.select_page'),
      run: () => this.#selection.mark(this.#list.value?.films ?? [], true),
    };
    const others = may('operator') ? [selectPage] : [];
    const help = bindListKeys(this, t('archive.films'), t('archive.search'), others);
    this.listen(parts.keys, 'click', help);
    parts.text.title = withKey(t('archive.search'), '/');
  }
}

const markColumn = () =>
  column(
    'mark',
    html`<label><span class="visually-hidden">${t('archive.select_page')}</span><input type="checkbox" data-mark-page /></label>`,
    ({ id, name }) =>
      html`<label><span class="visually-hidden">${t('archive.select', { name })}</span><input type="checkbox" data-mark="${id}" /></label>`,
    undefined,
    '3rem',
  );

const columns = () => [
  ...(may('operator') ? [markColumn()] : []),
  column('film', t('archive.film'), nameMarkup, 'name', '25%'),
  column('project', t('archive.project'), ({ project }) => likeButton('project', project), 'project', '15%'),
  column('asset', t('archive.asset'), ({ asset }) => likeButton('asset', asset), 'asset', '10%'),
  column('rig', t('archive.rig'), rigMarkup, 'rig_name', '14%'),
  column('state', t('list.status'), stateMarkup, 'state', '19%'),
  figures('priority', t('archive.priority'), ({ priority }) => signed(priority, 0), 'priority', '7.5rem'),
  figures(
    'length',
    t('list.length'),
    ({ distance_m: m }) => (m === null ? null : html`<b class="number nowrap">${chainage(m)}</b>`),
    'distance_m',
    '7.5rem',
  ),
];

const nameMarkup = ({ name, path, size, inspection_id: inspection }) =>
  html`${inspection ? html`<a href="/inspections/${inspection}">${name}</a>` : html`<b>${name}</b>`}<small class="two-lines" title="${path}">${path} · ${bytes(size)}</small>`;

const rigMarkup = ({ has_rig: hasRig, rig_name: rig, rule }) =>
  html`${hasRig ? (rig ?? t('archive.rig_own')) : html`<span class="dim">${t('archive.rig_none')}</span>`}${rule && html`<small>${t('archive.by_rule', { rule })}</small>`}`;

function stateMarkup(film) {
  const { state, error, frames_done: done, frames_total: total } = film;
  return html`${statusChip(state, film)} ${outdatedFilter(film.outdated)}
    ${
      state === 'running' &&
      html`<span class="inspection__progress stack full small"><progress class="bar" max="1" value="${total ? done / total : 0}" aria-label="${t('progress.label')}"></progress>
      <span class="dim number">${pace(film)}</span></span>`
    }
    ${error && html`<small class="two-lines" title="${errorText(error)}">${errorText(error)}</small>`}`;
}

customElements.define('films-page', FilmsPage);
