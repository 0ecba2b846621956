/** The issues that stand against a report, blocking ones first; each has a button that leads to the place to fix it. */

import { html, render, renderNew } from '../../../core/page/html.js';
import { lostRuns } from '../../../core/survey/lost.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { timecode } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';
import { repairsOf } from './repairs.js';
import { sentenceOf } from './sentences.js';

const OF_HEADER = new Set(['header_field_empty', 'abandoned_without_reason', 'end_not_reached', 'rig_pipe_differs']);
const OF_CORRECTIONS = new Set(['length_unknown', 'correction_failed', 'length_forced']);
/** Issues of the observation itself, which open its form. */
const OF_FORM = new Set([
  'no_code',
  'unknown_code',
  'unknown_character',
  'attribute_missing',
  'too_small',
  'too_large',
  'other_without_remark',
  'no_joint_near',
  'severe_without_photo',
]);

/** More lost stretches than this are not listed: the strip shows them all. */
const LISTED = 50;

export class ChecksPanel extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'panels/checks-panel'>} */
    this.parts = render(
      this,
      html`<div class="panel-head checks__head"><p role="status" data-part="summary"></p>
          <button class="button button--quiet button--small" data-part="again">${icon('retry')}${t('checks.again')}</button></div>
        <div data-part="list"></div>
        <section aria-labelledby="checks-lost" data-part="lostField" hidden><h3 class="checks__title" id="checks-lost">${t('checks.lost_list')}</h3>
          <ul class="checks__group pad-1" data-part="lost"></ul></section>`,
    );
    const { desk, parts } = this;
    this.listen(parts.again, 'click', () => desk.checks.load().catch(toastError));
    this.listen(parts.list, 'click', ({ target }) => {
      const button = target.closest('[data-issue]');
      if (!button) return;
      const issue = desk.checks.value[Number(button.dataset.issue)];
      if (button.dataset.repair) repairsOf(issue, desk)[Number(button.dataset.repair)].run();
      else this.#goTo(issue);
    });
    this.listen(parts.lost, 'click', ({ target }) => {
      const button = target.closest('[data-frame]');
      if (button) desk.seek(Number(button.dataset.frame));
    });
    this.listen([desk.checks, desk.observations], 'change', () => this.#show());
    this.listen(desk.track, 'change', () => this.#showLost());
    this.#show();
  }

  #show() {
    const { parts, desk } = this;
    const { value: issues } = desk.checks;
    this.#showLost();
    if (issues === null) {
      parts.summary.textContent = t('checks.looking');
      return;
    }
    const [blocking, warnings] = ['block', 'warn'].map((level) => issues.filter((issue) => issue.level === level));
    parts.summary.textContent = [
      blocking.length && t('checks.blocking', { n: blocking.length }),
      warnings.length && t('checks.warnings', { n: warnings.length }),
    ]
      .filter(Boolean)
      .join(' · ');
    renderNew(
      parts.list,
      issues.length === 0
        ? html`<div class="row at-top gap-3 checks__none sign-ok">${icon('check')}<div><p><b>${t('checks.nothing')}</b></p>
            <p class="dim">${t('checks.nothing_help')}</p></div></div>`
        : html`${[blocking, warnings].map(
            (found) =>
              found.length > 0 && html`<ul class="checks__group pad-1">${found.map((issue) => this.#row(issue))}</ul>`,
          )}`,
    );
  }

  /** Lists the longest stretches in which the wall was lost, in the order of the film. */
  #showLost() {
    const { parts, desk } = this;
    const length = ({ first, last }) => last - first;
    const runs = lostRuns(desk.track.column('status'))
      .sort((a, b) => length(b) - length(a))
      .slice(0, LISTED)
      .sort((a, b) => a.first - b.first);
    parts.lostField.hidden = runs.length === 0;
    const times = desk.track.column('time_s');
    renderNew(
      parts.lost,
      html`${runs.map(
        ({ first, last }) => html`<li class="entry check sign-weak">${icon('alert')}
        <p class="number">${t('checks.lost_from_to', { from: timecode(times[first]), to: timecode(times[last]), n: last - first + 1 })}</p>
        <button class="button button--small" data-frame="${first}">${t('checks.look')}</button></li>`,
      )}`,
    );
  }

  #row(issue) {
    const { desk } = this;
    const { level, observation_id: id } = issue;
    const index = desk.checks.value.indexOf(issue);
    const action = actionOf(issue);
    const repairs = mayEdit() ? repairsOf(issue, desk) : [];
    return html`<li class="entry check ${level === 'block' ? 'sign-lost' : 'sign-weak'}">${icon(level === 'block' ? 'stop' : 'alert')}
      <p>${sentenceOf(issue, id && desk.observations.find(id))}</p>
      <div class="check__actions flow">${repairs.map(
        ({ name }, i) => html`<button class="button button--small" data-issue="${index}"
        data-repair="${i}">${name}</button>`,
      )}${action && html`<button class="button button--small" data-issue="${index}">${action}</button>`}</div></li>`;
  }

  #goTo({ code, observation_id: id, params }) {
    const { desk } = this;
    if (id !== null) {
      const item = desk.observations.find(id);
      if (!item) return; // deleted meanwhile
      desk.goTo(id);
      desk.tab.set('defects');
      if (desk.incomplete.includes(item)) desk.askAll(id);
      else if (OF_FORM.has(code)) desk.editing.set(true);
    } else if (OF_HEADER.has(code)) {
      const field = { abandoned_without_reason: 'abandon_reason', end_not_reached: 'end_condition' }[code];
      desk.tab.set('header');
      this.closest('inspection-page')
        .querySelector('header-form')
        .goTo(field ?? params.field);
    } else desk.tab.set('corrections');
  }
}

/** Returns the label of an issue's button; null where there is no place to go to. */
function actionOf({ code, observation_id: id }) {
  if (id !== null) return OF_FORM.has(code) ? t('checks.edit') : t('checks.go');
  if (OF_HEADER.has(code)) return t('checks.header');
  return OF_CORRECTIONS.has(code) ? t('checks.corrections') : null;
}

customElements.define('checks-panel', ChecksPanel);
