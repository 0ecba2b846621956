/**
 * The issues that stand against a report, blocking ones first; each has a button that leads to the place to
 * fix it.
 */

import { html, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { t } from '../../core/words.js';
import { icon } from '../icon/icon.js';
import { toastError } from '../toast-stack/toast-stack.js';
import { sentenceOf } from './sentences.js';

const OF_HEADER = new Set(['header_field_empty', 'abandoned_without_reason', 'end_not_reached']);
const OF_CORRECTIONS = new Set(['length_unknown', 'correction_failed', 'length_forced']);
/** Issues of the observation itself, which open its form. */
const OF_FORM = new Set([
  'no_code', 'unknown_code', 'unknown_character', 'attribute_missing', 'other_without_remark',
  'no_joint_near', 'severe_without_photo',
]);

class ChecksPanel extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.parts = render(
      this,
      html`<div class="checks__head"><p role="status" data-part="summary"></p>
          <button class="button button--quiet button--small" data-part="again">${icon('retry')}${t('checks.again')}</button></div>
        <div data-part="list"></div>`,
    );
    const { desk, parts } = this;
    this.listen(parts.again, 'click', () => desk.checks.load().catch(toastError));
    this.listen(parts.list, 'click', ({ target }) => {
      const button = target.closest('[data-issue]');
      if (button) this.#goTo(desk.checks.value[Number(button.dataset.issue)]);
    });
    this.listen(desk.checks, 'change', () => this.#show());
    this.listen(desk.observations, 'change', () => this.#show());
    this.#show();
  }

  #show() {
    const { parts, desk } = this;
    const { value: issues } = desk.checks;
    if (issues === null) {
      parts.summary.textContent = t('checks.looking');
      return;
    }
    const groups = [
      ['block', t('checks.blocking', { n: issues.filter(({ level }) => level === 'block').length })],
      ['warn', t('checks.warnings', { n: issues.filter(({ level }) => level === 'warn').length })],
    ].map(([level, title]) => ({ level, title, found: issues.filter((issue) => issue.level === level) }));
    parts.summary.textContent = groups
      .filter(({ found }) => found.length)
      .map(({ title }) => title)
      .join(' · ');
    const text = JSON.stringify([issues, issues.map((issue) => this.#sentence(issue))]);
    if (parts.list.dataset.shows === text) return;
    parts.list.dataset.shows = text;
    render(
      parts.list,
      issues.length === 0
        ? html`<div class="checks__none">${icon('check')}<div><p><b>${t('checks.nothing')}</b></p>
            <p class="dim">${t('checks.nothing_help')}</p></div></div>`
        : html`${groups
            .filter(({ found }) => found.length)
            .map(({ level, found }) => html`<ul class="checks__group">${found.map((issue) => this.#row(issue, level))}</ul>`)}`,
    );
  }

  #row(issue, level) {
    const action = actionOf(issue);
    const index = this.desk.checks.value.indexOf(issue);
    return html`<li class="check check--${level}">${icon(level === 'block' ? 'stop' : 'alert')}
      <p>${this.#sentence(issue)}</p>
      ${action && html`<button class="button button--small" data-issue="${index}">${action}</button>`}</li>`;
  }

  #sentence(issue) {
    const { observation_id: id } = issue;
    return sentenceOf(issue, id && this.desk.observations.find(id));
  }

  #goTo({ code, observation_id: id, params }) {
    const { desk } = this;
    if (id !== null) {
      if (!desk.observations.find(id)) return; // deleted meanwhile
      desk.goTo(id);
      desk.tab.set('defects');
      if (OF_FORM.has(code)) desk.editing.set(true);
    } else if (OF_HEADER.has(code)) {
      const field = { abandoned_without_reason: 'abandon_reason', end_not_reached: 'end_condition' }[code];
      desk.tab.set('header');
      this.closest('inspection-page').querySelector('header-form').goTo(field ?? params.field);
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
