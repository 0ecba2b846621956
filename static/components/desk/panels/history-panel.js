/** Who changed what, the newest first: every change of the inspection and its defects, before and after. */

import { ownKey } from '../../../core/page/keys.js';
import { get, refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { errorText, pieces, t, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { differences, labelOf } from './differences.js';
import { remarkText } from './history-remarks.js';

/** Rows created at once. */
const PAGE = 40;

/** The sign of each action. */
const SIGNS = {
  created: 'plus',
  changed: 'edit',
  corrected: 'settings',
  rescaled: 'settings',
  smoothed: 'settings',
  rig_changed: 'retry',
  continued: 'live',
  finished: 'check',
  labelled: 'label',
  imported: 'plus',
  deleted: 'trash',
  restored: 'undo',
  attached: 'plus',
  detached: 'trash',
  told: 'check',
  not_told: 'alert',
  accepted: 'check',
  question: 'help',
  comment: 'edit',
  settled: 'check',
  unsettled: 'help',
  withdrawn: 'trash',
  finding_accepted: 'check',
  finding_rejected: 'close',
  finding_reopened: 'undo',
  reviewed: 'forward',
  delivered: 'link',
  client_accepted: 'check',
  client_asked: 'help',
  client_answered: 'forward',
};

/** Events that replaced a version of what people state; it can be restored. */
const VERSIONED = { observation: ['changed', 'deleted'], inspection: ['changed', 'finished', 'corrected'] };

const hasVersion = ({ action, observation_id: id, before }) =>
  before !== null && VERSIONED[id === null ? 'inspection' : 'observation'].includes(action);

export class HistoryPanel extends Component {
  #events = [];
  #shown = PAGE;
  #round = 0;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'panels/history-panel'>} */
    this.parts = render(
      this,
      html`<div class="panel-head">
          <label class="switch row"><input type="checkbox" data-part="only" />${t('history.selected')}</label>
          <p class="dim small">${pieces('history.undo_hint', { key: html`<kbd>${ownKey('Ctrl + Z')}</kbd>` })}</p>
        </div>
        <p class="pad-4 dim unless-empty" role="status" data-part="note"></p>
        <ol data-part="rows" aria-label="${t('history.label')}"></ol>
        <div class="history__more"><button class="button button--small" data-part="more" hidden></button></div>`,
    );
    const { parts, desk } = this;
    this.listen(parts.only, 'change', () => this.#load());
    this.listen(parts.more, 'click', () => {
      this.#shown += PAGE;
      this.#show();
    });
    this.listen(parts.rows, 'click', ({ target }) => {
      const button = target.closest('[data-restore]');
      if (button) orToast(() => this.#restore(Number(button.dataset.restore)));
      const link = target.closest('[data-observation]');
      if (link && desk.observations.find(link.dataset.observation)) desk.goTo(link.dataset.observation);
    });
    this.listen(desk.selection, 'change', () => parts.only.checked && this.#load());
    // Every change goes through one of these, and is stored when they report it.
    this.listen(desk.outbox, 'answered', () => this.#load());
    this.listen(desk.inspection, 'change', () => this.#changed());
    this.listen(desk.tab, 'change', () => this.#load());
    this.#load();
  }

  #changed() {
    const { revision, header, name, status } = this.desk.inspection.value;
    const seen = JSON.stringify([revision, header, name, status]);
    if (seen !== this.seen) this.#load();
    this.seen = seen;
  }

  /** Loads the history, only while it is visible. */
  async #load() {
    if (this.desk.tab.value !== 'history') return;
    const { parts, desk } = this;
    const { value: selected } = desk.selection;
    parts.only.disabled = !selected && !parts.only.checked;
    const query = parts.only.checked && selected ? `?observation=${selected}` : '';
    this.#round += 1;
    const round = this.#round;
    try {
      const { events } = await get(`/api/inspections/${desk.inspection.id}/events${query}`, this.signal);
      if (round !== this.#round) return;
      this.#events = events;
      this.#shown = PAGE;
      parts.note.textContent = events.length ? '' : t('history.empty');
    } catch (error) {
      const refusal = refusalIn(error);
      if (refusal) parts.note.textContent = errorText(refusal);
    }
    this.#show();
  }

  #show() {
    const { parts } = this;
    const rest = this.#events.length - this.#shown;
    parts.more.hidden = rest <= 0;
    parts.more.textContent = t('history.more', { n: Math.min(rest, PAGE) });
    render(parts.rows, html`${this.#events.slice(0, this.#shown).map((event, i) => this.#row(event, i))}`);
  }

  #row(event, index) {
    const { at, who, observation_id: id } = event;
    const remark = remarkText(event);
    const title = this.#titleOf(event);
    const changes = differences(event);
    return html`<li class="event entry pad-head sign-dim">${icon(SIGNS[event.action] ?? 'info')}
      <div class="event__what stack gap-1">
        <p class="strong">${
          id && this.desk.observations.find(id)
            ? html`<button class="link" data-observation="${id}">${title}</button>`
            : html`<b>${title}</b>`
        }</p>
        ${
          changes.length > 0 &&
          html`<dl class="event__changes flow small">${changes.map(
            ({ name, before, after }) =>
              html`<div><dt class="dim">${labelOf(name)}</dt><dd class="breaks">${before !== null && html`<del class="dim">${before}</del> `}<ins>${after ?? '–'}</ins></dd></div>`,
          )}</dl>`
        }
        ${remark && html`<p class="event__remark small">“${remark}”</p>`}
        ${
          mayEdit() &&
          hasVersion(event) &&
          html`<p><button type="button" class="button button--small" data-restore="${index}"
          aria-label="${t('history.restore_title', { name: title })}">${icon('undo')}${t('history.restore')}</button></p>`
        }
      </div>
      <p class="event__who packed small dim"><time datetime="${at}">${date(at)}</time><span>${who}</span></p></li>`;
  }

  /** Restores the version that an event has replaced, as a new change. */
  async #restore(index) {
    const { desk } = this;
    const { observation_id: id, action, before } = this.#events[index];
    let isChange;
    if (id !== null) isChange = desk.observations.restore(id, before);
    else if (action === 'corrected') {
      isChange = JSON.stringify(before) !== JSON.stringify(desk.corrections.value?.stated);
      if (isChange && !(await desk.correct(before, t('history.restored_remark')))) return;
    } else isChange = await desk.inspection.restore(before);
    if (isChange) desk.done(t('history.restored'));
    else desk.done(t('history.same'), { action: null });
  }

  #titleOf({ action, observation_id: id, before, after }) {
    if (action === 'reviewed') return t('history.inspection_reviewed', { state: wordFor('review', after.review) });
    if (id === null) return wordFor('history_inspection', action) ?? action;
    const known = this.desk.observations.find(id);
    const code = (after ?? before)?.code;
    const name = known ? nameOf(known) : [t('history.deleted_defect'), code].filter(Boolean).join(' ');
    return wordFor('history_observation', action, { name }) ?? action;
  }
}

customElements.define('history-panel', HistoryPanel);
