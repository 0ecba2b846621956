/** Defects of all inspections: found by code, severity, words, asset and place; each opens its frame. */

import { Catalogue, labelOf } from '../../../core/defects/codes.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { chainage, clockHour, count, day, lengthUnit, parseDistance, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { assetPath } from '../../assets/assets-page/asset-table.js';
import { framedPage, exportButton, likeButton } from '../../shared/page-frame/page-frame.js';
import { bindListKeys, clearFilters, followList, tableMarkup } from '../../shared/page-frame/list-page.js';
import { codeSearch } from '../../defects/code-search/code-search.js';
import { column, figures, orDash } from '../../shared/data-table/data-table.js';
import { GRADES, severityMark, severityWord } from '../../shared/severity-mark/severity-mark.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const FILTERS = ['text', 'code', 'severity_from', 'project', 'asset', 'from_m', 'to_m', 'clock', 'after', 'before'];
const HOURS = [12, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
const CODE = /^[A-Z][A-Z0-9]{0,7}$/;

export class FindPage extends Component {
  #list;

  mount() {
    /** @type {Parts<'find-page/find-page'>} */
    this.parts = render(
      this,
      framedPage({ title: t('archive.defects'), ways: exportButton(), content: contentMarkup() }),
    );
    const { parts } = this;
    const list = followList(this, {
      path: '/api/archive/defects',
      filters: FILTERS,
      rows: 'defects',
      caption: t('archive.defects'),
      columns: columns(),
      keyOf: (item) => item.observation_id,
      chosen: ({ project, asset }) => [
        ['project', t('archive.project'), project],
        ['asset', t('archive.asset'), asset],
      ],
      show: ({ total }) => this.#show(total),
    });
    this.#list = list;
    for (const name of FILTERS) if (parts[name]) parts[name].value = list.filters[name];
    parts.more.open = ['from_m', 'to_m', 'clock', 'after', 'before'].some((name) => list.filters[name]);
    this.listen(parts.form, 'input', () => orToast(() => this.#find()));
    this.listen(parts.form, 'submit', (event) => event.preventDefault());
    this.listen(parts.clear, 'click', () => clearFilters(this, list, FILTERS));
    this.#offersCodes();
    bindListKeys(this, t('archive.defects'), t('search.defects'));
  }

  /** Offers the codes of the catalogue; the beginning of one finds all below it. */
  async #offersCodes() {
    const { code, codes } = this.parts;
    const pick = (row) => {
      code.value = row.code;
      orToast(() => this.#find());
    };
    await orToast(async () => codeSearch(code, codes, await Catalogue.load(this.signal), pick));
  }

  #find() {
    const { parts } = this;
    const code = parts.code.value.trim().toUpperCase();
    const wanted = {
      text: parts.text.value,
      code: CODE.test(code) ? code : '',
      severity_from: parts.severity_from.value,
    };
    for (const name of ['clock', 'after', 'before']) wanted[name] = parts[name].value;
    let fault = '';
    for (const name of ['from_m', 'to_m']) {
      const metres = parts[name].value.trim() === '' ? '' : parseDistance(parts[name].value);
      const isWrong = metres === null;
      parts[name].setAttribute('aria-invalid', String(isWrong));
      if (isWrong) fault = t('search.distance_fault', { example: `12.5 ${lengthUnit}` });
      else wanted[name] = metres === '' ? '' : String(metres);
    }
    parts.distanceFault.textContent = fault;
    return fault ? null : this.#list.want(wanted);
  }

  #show(total) {
    const { parts } = this;
    const isNarrowed = FILTERS.some((name) => this.#list.filters[name]);
    parts.clear.hidden = !isNarrowed;
    parts.nothing.textContent = isNarrowed ? t('search.nothing') : t('search.no_defects');
    parts.found.textContent = total ? t('search.found', { n: total, count: count(total) }) : '';
  }
}

const contentMarkup =
  () => html`<form class="search-form one-if-narrow stack gap-3 at-bottom below-3" role="search" data-part="form">
    <div class="field search-form__text"><label for="defects-text">${t('search.words')}</label>
      <input class="input" id="defects-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('search.words_hint')}" data-part="text" /></div>
    <div class="field holds"><label for="defects-code">${t('search.code')}</label>
      <input class="input" id="defects-code" role="combobox" aria-autocomplete="list" aria-expanded="false" aria-controls="defects-codes"
        autocomplete="off" spellcheck="false" placeholder="${t('form.code_hint')}" data-part="code" />
      <ul class="code-search__list panel" id="defects-codes" role="listbox" aria-label="${t('form.codes')}" data-part="codes" hidden></ul></div>
    <div class="field"><label for="defects-severity">${t('search.severity')}</label>
      <select class="input" id="defects-severity" data-part="severity_from"><option value="">${t('search.any')}</option>
        ${GRADES.map((grade) => html`<option value="${grade}">${grade} · ${severityWord(grade)}</option>`)}</select></div>
    <details class="more whole-row" data-part="more"><summary>${t('search.more')}</summary>
      <div class="search-form__place stack gap-3">
        <div class="field"><label for="defects-from">${t('search.from')}</label><span class="input-with-unit"><input class="input" id="defects-from" inputmode="decimal" autocomplete="off" aria-describedby="defects-distance" data-part="from_m" /><span class="unit">${lengthUnit}</span></span></div>
        <div class="field"><label for="defects-to">${t('search.to')}</label><span class="input-with-unit"><input class="input" id="defects-to" inputmode="decimal" autocomplete="off" aria-describedby="defects-distance" data-part="to_m" /><span class="unit">${lengthUnit}</span></span></div>
        <div class="field"><label for="defects-clock">${t('search.clock')}</label>
          <select class="input" id="defects-clock" data-part="clock"><option value="">${t('search.any')}</option>
            ${[
              ['11-1', t('search.crown')],
              ['2-4', t('search.right')],
              ['5-7', t('search.invert')],
              ['8-10', t('search.left')],
            ].map(([value, name]) => html`<option value="${value}">${name}</option>`)}
            ${HOURS.map((hour) => html`<option value="${hour}">${clockHour(hour)}</option>`)}</select></div>
        <div class="field"><label for="defects-after">${t('search.after')}</label><input class="input" id="defects-after" type="date" data-part="after" /></div>
        <div class="field"><label for="defects-before">${t('search.before')}</label><input class="input" id="defects-before" type="date" data-part="before" /></div>
      </div>
      <span class="fault" id="defects-distance" role="alert" data-part="distanceFault"></span></details>
  </form>
  <div class="search-head row gap-row wrap"><p class="dim number" role="status" data-part="found"></p><span class="find__filters" data-part="chips"></span>
    <button class="button button--small button--quiet" data-part="clear">${t('list.clear')}</button></div>
  ${tableMarkup('defects-table', '')}`;

/** The address of a defect in its inspection: the page opens it at its frame. */
export const defectPath = ({ inspection_id: inspection, observation_id: defect }) =>
  `/inspections/${inspection}?${new URLSearchParams({ defect })}`;

const columns = () => [
  figures('severity', t('search.severity_column'), severityMarkup),
  column('defect', t('search.defect'), defectMarkup, 'code', '30%'),
  column('distance', t('search.distance'), distanceMarkup, 'distance_m'),
  column(
    'asset',
    t('archive.asset'),
    ({ asset }) =>
      html`${likeButton('asset', asset)}${asset && html`<small><a href="${assetPath(asset)}">${t('assets.history')}</a></small>`}`,
    'asset',
  ),
  column('project', t('archive.project'), ({ project }) => likeButton('project', project), 'project'),
  column('inspection', t('search.inspection'), inspectionMarkup, 'inspection'),
  figures(
    'day',
    t('search.day'),
    ({ surveyed_on: on }) => html`<span class="number nowrap">${day(on)}</span>`,
    'surveyed_on',
  ),
];

const severityMarkup = ({ severity }) =>
  html`<span class="inspection__worst inline-row">${severityMark(severity)}<b>${severity ?? ''}</b> <span class="dim">${wordFor('severity', String(severity ?? 'none'))}</span></span>`;

const defectMarkup = (item) =>
  html`<a href="${defectPath(item)}">${[item.code, item.char1, item.char2].filter(Boolean).join(' ') || t('code.none')}</a>
    <small>${labelOf(item)}</small>${item.remark && html`<small class="two-lines">“${item.remark}”</small>`}`;

const distanceMarkup = ({ distance_m: m, distance_u95_m: u95, clock }) =>
  html`${m === null ? orDash(null) : html`<b class="number nowrap">${chainage(m)}</b> <small class="number nowrap">${u95 !== null && plusMinus(u95)}</small>`}
    ${clock && html`<small>${clockHour(clock)}</small>`}`;

const inspectionMarkup = ({ inspection_id: id, inspection, frame, photo }) =>
  html`<a href="/inspections/${id}">${inspection}</a><small class="number">${t('search.frame', { frame })}${photo && html` · ${t('search.photo')}`}</small>`;

customElements.define('find-page', FindPage);
