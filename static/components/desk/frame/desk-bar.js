/** The top bar of an inspection: its state and its review, saving, the history, the exports, who else is here. */

import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { isFinished, mayGoOn } from '../../../core/survey/inspection.js';
import { withKey } from '../../../core/page/keys.js';
import { isLocked } from '../../../core/defects/review.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { openExport } from '../../reports/export-dialog/export-dialog.js';
import { EMERGENCY, FOLDED_GROUPS, IN_FRONT, formatOf } from '../../reports/export-dialog/formats.js';
import { icon } from '../../shared/icon/icon.js';
import { pace } from '../../inspections/inspection-list/row.js';
import { stepName } from '../actions/step-names.js';
import { editLabels, showLabelButton } from '../../inspections/labels/labels.js';
import { closesElsewhere } from '../../shared/menu/menu.js';
import { GRAVEST } from '../../shared/severity-mark/severity-mark.js';
import { outdatedChip, reviewChip, statusChip } from '../../shared/status-chip/status-chip.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { showSaving } from './saving.js';

export class DeskBar extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    const { id, name } = this.desk.inspection.value;
    /** @type {Parts<'frame/desk-bar'>} */
    this.parts = render(
      this,
      html`<header class="topbar row line-below holds desk-bar">
          <div class="desk-bar__title row gap-3 shrinks">
            <a class="brand inline-row plain" href="/" aria-label="${t('desk.all')}">${icon('back')}${icon('logo')}</a>
            <h1 class="desk-bar__name one-line" title="${name}">${name}</h1>
            <span role="status" data-part="chip"></span>
            <button type="button" class="chip-button" title="${t('tab.review')}" data-part="review"></button>
            <button type="button" class="chip-button label-button inline-row gap-1 help" data-part="labels"></button>
            <span class="desk-bar__pace small nowrap dim number" data-part="pace"></span>
            <p class="desk-bar__people row gap-1 shrinks small" role="status" data-part="people"></p>
          </div>
          <div class="desk-bar__tools row gap-3 grow shrinks">
            <button class="button button--small" data-part="cancel" data-needs="operator" hidden>${icon('stop')}<span
              class="word-if-wide">${t('desk.cancel')}</span></button>
            <button class="button button--small" data-part="retry" data-needs="operator" hidden>${icon('retry')}${t('desk.retry')}</button>
            <button class="button button--small" data-part="recordOn" data-needs="operator" title="${t('again.on_title')}" hidden>${icon('live')}<span
              class="word-if-wide">${t('again.on')}</span></button>
            <p class="desk-bar__lock one-line shrinks small dim" role="status" data-part="lock" hidden></p>
            <span class="spacer"></span>
            <p class="save small dim number" role="status" data-part="save" data-needs="operator"></p>
            <button class="button button--quiet button--small" data-part="undo" data-needs="operator">${icon('undo')}
              <span class="word-if-wide">${t('desk.undo')}</span></button>
            <button class="button button--quiet button--small button--icon" data-part="redo" data-needs="operator">${icon('redo')}
              <span class="visually-hidden">${t('desk.redo')}</span></button>
            <button class="button button--quiet button--small desk-bar__keys" data-part="help" title="${withKey(t('desk.keys'), '?')}">${icon('keys')}
              <span class="word-if-wide">${t('desk.keys')}</span></button>
            <button class="button button--small" data-part="finish" data-needs="operator"></button>
            <details class="menu holds" data-part="menu">
              <summary class="button button--small button--primary">${icon('download')}${t('desk.export')}</summary>
              ${exportsMarkup(id)}
            </details>
            <person-menu></person-menu>
          </div>
          <progress class="bar desk-bar__progress" max="1" data-part="bar" aria-label="${t('progress.label')}"></progress>
        </header>`,
    );
    const { desk, page, parts } = this;
    for (const command of ['cancel', 'recordOn', 'finish', 'undo', 'redo', 'help']) {
      this.listen(parts[command], 'click', () => page[command]());
    }
    this.listen(parts.retry, 'click', () => page.trackAgain());
    this.listen(parts.review, 'click', () => desk.tab.set('review'));
    this.listen(parts.labels, 'click', () =>
      orToast(() => editLabels(desk.inspection.value, () => desk.inspection.load())),
    );
    closesElsewhere(parts.menu, this.signal);
    this.listen(parts.menu, 'click', ({ target }) => {
      const item = target.closest('[data-export]');
      if (!item) return;
      parts.menu.querySelector('summary').focus(); // the dialog returns the focus to it
      openExport(desk, formatOf(item.dataset.export));
    });
    this.listen(desk.inspection, 'change', () => this.#showState());
    this.listen(desk.people, 'change', () => this.#showPeople());
    this.listen(desk.observations, 'change', () => this.#showEmergency());
    this.listen(desk.history, 'change', () => this.#showHistory());
    this.#showState();
    showSaving(parts.save, desk, this.signal);
    this.#showEmergency();
    this.#showHistory();
  }

  #showState() {
    const { parts, desk } = this;
    const { status, progress, labels, outdated, live, review } = desk.inspection.value;
    showLabelButton(parts.labels, labels);
    renderNew(parts.chip, html`${statusChip(status, desk.inspection.value)} ${outdatedChip(outdated)}`);
    const isRunning = status === 'running';
    parts.pace.textContent = isRunning ? pace(progress) : '';
    parts.bar.classList.toggle('desk-bar__progress--off', !isRunning);
    parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
    const locked = isLocked({ review });
    parts.cancel.hidden = !desk.inspection.isUnfinished;
    parts.recordOn.hidden = !mayGoOn(desk.inspection.value);
    const isToRepeat = (outdated || desk.inspection.damage) && !locked;
    parts.retry.hidden = status !== 'failed' && status !== 'cancelled' && !isToRepeat;
    const isDraft = review.state === 'draft'; // as in the list, it needs no word
    parts.review.hidden = isDraft;
    renderNew(parts.review, html`${!isDraft && reviewChip(review.state)}`);
    parts.lock.hidden = !locked;
    setText(parts.lock, locked ? t('reviewing.locked', { who: review.by, when: date(review.at) }) : '');
    const hasEnded = isFinished(desk.inspection.value);
    const text = hasEnded ? t('finish.finished') : t('finish.open');
    parts.finish.hidden = live !== null; // the live bar has it
    renderNew(parts.finish, html`${icon(hasEnded ? 'check' : 'flag')}<span class="word-if-wide">${text}</span>`);
    parts.finish.setAttribute('aria-label', text);
  }

  #showPeople() {
    const { people } = this.parts;
    const { names } = this.desk.people;
    const list = names.map(([name, pages]) => (pages > 1 ? t('people.pages', { name, pages }) : name)).join(', ');
    people.title = names.length ? t('people.here', { n: names.length, names: list }) : '';
    renderNew(people, html`${people.title && icon('people')}<span class="one-line">${people.title}</span>`);
  }

  #showEmergency() {
    this.parts.emergency.hidden = !this.desk.observations.value.some(({ severity }) => severity === GRAVEST);
  }

  /** Shows on each button the step that it undoes or redoes. */
  #showHistory() {
    const { undo, redo } = this.parts;
    const { last, next } = this.desk.history;
    undo.disabled = !last;
    redo.disabled = !next;
    undo.title = withKey(last ? t('desk.undo_step', { step: stepName(last) }) : t('desk.undo_none'), 'U');
    redo.title = withKey(next ? t('desk.redo_step', { step: stepName(next) }) : t('desk.redo_none'), 'Shift + U');
  }
}

const exportMarkup = ({ kind, name, help }) => html`<button class="menu__item" data-export="${kind}"><b>${name}</b>
  <span class="dim">${help}</span></button>`;

/** Everything that an inspection can be exported as; the part `emergency` is for a defect that cannot wait. */
const exportsMarkup = (id) => html`<div class="menu__list menu__list--exports panel">
  <div class="menu__group" data-part="emergency" hidden>${exportMarkup(EMERGENCY)}</div>
  <ul class="menu__group">${IN_FRONT.map((kind) => html`<li>${exportMarkup(formatOf(kind))}</li>`)}</ul>
  <details class="menu__group"><summary class="menu__fold row">${icon('forward')}${t('export.more_formats')}</summary>
  ${FOLDED_GROUPS.map(
    ({ title, formats }, i) => html`<section class="menu__group" aria-labelledby="exports-${i}">
    <h2 class="menu__title help strong" id="exports-${i}">${title}</h2>
    <ul>${formats.map((format) => html`<li>${exportMarkup(format)}</li>`)}</ul></section>`,
  )}
  <section class="menu__group" aria-labelledby="exports-other">
    <h2 class="menu__title help strong" id="exports-other">${t('export.other')}</h2>
    <ul><li><a class="menu__item" download href="/api/inspections/${id}/track?format=csv"><b>${t('desk.export_track')}</b>
        <span class="dim">${t('desk.export_track_help')}</span></a></li>
      <li><a class="menu__item" href="/compare?a=${id}"><b>${t('compare.with')}</b>
        <span class="dim">${t('compare.with_help')}</span></a></li></ul></section></details></div>`;

customElements.define('desk-bar', DeskBar);
