/** Chooses the two runs to compare among those that the server finds; the address keeps them. */

import { get } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const SIDES = ['a', 'b'];

export class RunChoice extends Component {
  #list = null;
  #chosen = [];

  mount() {
    // A search must leave the runs in the address, so they are among the filters; the server ignores them.
    this.#list = new PagedList('/api/inspections', { filters: [...SIDES, 'search'], signal: this.signal });
    /** @type {Parts<'compare/run-choice'>} */
    this.parts = render(
      this,
      html`<div class="compare__choose">
        <search class="field"><label for="compare-search">${t('compare.search')}</label>
          <input class="input" id="compare-search" type="search" autocomplete="off" maxlength="200" data-part="search" /></search>
        ${SIDES.map(
          (
            side,
          ) => html`<div class="field"><label for="compare-${side}">${side === 'a' ? t('compare.run_a') : t('compare.run_b')}</label>
          <select class="input" id="compare-${side}" data-part="${side}"></select></div>`,
        )}
        <button class="button" data-part="swap">${icon('swap')}${t('compare.swap')}</button>
        <span data-part="history"></span>
      </div>`,
    );
    const { parts } = this;
    const { a, b } = this.#list.filters;
    parts.swap.disabled = !a || !b;
    this.listen(parts.swap, 'click', () => go({ a: b, b: a }));
    for (const side of SIDES) this.listen(parts[side], 'change', () => go({ a, b, [side]: parts[side].value }));
    this.listen(parts.search, 'input', () => orToast(() => this.#list.want({ search: parts.search.value })));
    this.listen(this.#list, 'change', () => this.#show());
  }

  /** Offers runs; at first, where one is chosen, those of its asset. */
  async load() {
    const { filters } = this.#list;
    const ids = new Set(SIDES.map((side) => filters[side]).filter(Boolean));
    this.#chosen = await Promise.all([...ids].map((id) => get(`/api/inspections/${id}`, this.signal)));
    const asset = this.#chosen.find(({ header }) => header.asset_id)?.header.asset_id;
    if (asset) {
      const history = new URLSearchParams({ asset });
      render(
        this.parts.history,
        html`<a class="button" href="/assets?${history}">${icon('layers')}${t('assets.history')}</a>`,
      );
    }
    filters.search ||= (asset ?? '').slice(0, this.parts.search.maxLength);
    this.parts.search.value = filters.search;
    await this.#list.again();
  }

  /** Both lists keep the chosen runs, whatever is searched for. */
  #show() {
    const measured = this.#list.value.inspections.filter(({ distance_m: m }) => m !== null);
    const runs = new Map([...this.#chosen, ...measured].map((inspection) => [inspection.id, inspection]));
    for (const side of SIDES) {
      const choice = this.parts[side];
      render(
        choice,
        html`<option value="">${t('compare.choose')}</option>${[...runs.values()].map(
          (inspection) => html`<option
          value="${inspection.id}">${labelOf(inspection)}</option>`,
        )}`,
      );
      choice.value = this.#list.filters[side];
    }
  }
}

/** Writes the compared runs into the address. */
function go({ a, b }) {
  const query = new URLSearchParams(
    [
      ['a', a],
      ['b', b],
    ].filter(([, id]) => id),
  );
  location.assign(`/compare?${query}`);
}

const labelOf = ({ name, header }) => [name, header.asset_id, header.date].filter(Boolean).join(' · ');

customElements.define('run-choice', RunChoice);
