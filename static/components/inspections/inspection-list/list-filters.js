/** What narrows the list of inspections: words, states, worst severity, label, and the values of a row. */

import { html, render } from '../../../core/page/html.js';
import { STATES as REVIEW_STATES } from '../../../core/defects/review.js';
import { Component } from '../../../core/page/store.js';
import { t, wordFor } from '../../../core/page/words.js';
import { filterChips, followFilters } from '../../shared/page-frame/page-frame.js';
import { labelsInUse } from '../labels/labels.js';
import { GRADES, severityWord } from '../../shared/severity-mark/severity-mark.js';
import { STATES } from '../../shared/status-chip/status-chip.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const FIELDS = ['search', 'status', 'review', 'severity_from', 'label'];

/** Names of the filters, as in the address. */
export const FILTERS = [...FIELDS, 'project', 'no_project', 'asset', 'outdated'];

export class ListFilters extends Component {
  #list;

  mount() {
    /** @type {Parts<'inspection-list/list-filters'>} */
    this.parts = render(
      this,
      html`<search class="row gap-3 wrap below-4">
        <div class="field find__text"><label class="visually-hidden" for="find-text">${t('list.search')}</label>
          <input class="input" id="find-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('list.search_hint')}" data-part="search" /></div>
        ${choice(
          'status',
          t('list.filter'),
          t('list.all'),
          STATES.map((state) => [state, wordFor('status', state)]),
        )}
        ${choice(
          'review',
          t('reviewing.filter'),
          t('reviewing.any'),
          REVIEW_STATES.map((state) => [state, wordFor('review', state)]),
        )}
        ${choice(
          'severity_from',
          t('list.worst_filter'),
          t('list.worst_any'),
          GRADES.map((grade) => [grade, t('list.worst_from', { grade, word: severityWord(grade) })]),
        )}
        ${choice('label', t('labels.filter'), t('labels.any'), [])}
        <span class="find__filters" data-part="chips"></span>
        <p class="dim number find__count unless-empty" role="status" data-part="count"></p>
      </search>`,
    );
  }

  /**
   * @param {import('../../../core/page/paged-list.js').PagedList} list
   * @param {Element} rows a click on one of their values narrows the list to its like
   */
  fill(list, rows) {
    this.#list = list;
    // Only the changed one: a filter that a row has set is in the list before its field shows it.
    this.listen(this, 'input', ({ target }) => orToast(() => list.want({ [target.dataset.part]: target.value })));
    followFilters(rows, list, this.signal, orToast);
    this.listen(list, 'change', () => this.#show());
    for (const name of FIELDS) this.parts[name].value = list.filters[name];
    this.#offer(list.filters.label ? [list.filters.label] : []);
    orToast(() => this.offerLabels());
  }

  /** Offers the labels that are in use now. */
  async offerLabels() {
    this.#offer((await labelsInUse(this.signal)).map(({ label }) => label));
  }

  clear() {
    for (const name of FIELDS) this.parts[name].value = '';
    orToast(() => this.#list.want(Object.fromEntries(FILTERS.map((name) => [name, '']))));
    this.parts.search.focus();
  }

  showCount(text) {
    this.parts.count.textContent = text;
  }

  #offer(labels) {
    const { label } = this.parts;
    const { label: chosen } = this.#list.filters;
    const offered = chosen && !labels.includes(chosen) ? [chosen, ...labels] : labels;
    render(
      label,
      html`<option value="">${t('labels.any')}</option>${offered.map((name) => html`<option value="${name}">${name}</option>`)}`,
    );
    label.value = chosen;
    label.parentElement.hidden = offered.length === 0;
  }

  #show() {
    const { filters } = this.#list;
    const labels = [...this.parts.label.options].map(({ value }) => value).filter(Boolean);
    // A row may have a label that somebody gave after the options were read.
    if (filters.label && !labels.includes(filters.label)) this.#offer(labels);
    this.parts.label.value = filters.label;
    const chosen = [
      ['project', t('archive.project'), filters.project],
      ['no_project', t('archive.project'), filters.no_project && t('projects.none')],
      ['asset', t('archive.asset'), filters.asset],
      ['outdated', t('list.status'), filters.outdated && t('outdated.word')],
    ];
    render(this.parts.chips, filterChips(chosen.filter(([, , value]) => value)));
  }
}

function choice(name, title, any, options) {
  return html`<div class="field"><label class="visually-hidden" for="find-${name}">${title}</label>
  <select class="input" id="find-${name}" data-part="${name}"><option value="">${any}</option>
    ${options.map(([value, text]) => html`<option value="${value}">${text}</option>`)}</select></div>`;
}

customElements.define('list-filters', ListFilters);
