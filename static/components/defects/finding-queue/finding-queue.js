/**
 * What detectors propose, one finding at a time beside the film: it is accepted, which makes it an observation,
 * rejected, or passed over.
 */

import { withKey, ownKey } from '../../../core/page/keys.js';
import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { codeOf } from '../../../core/defects/codes.js';
import { whyLocked } from '../../../core/defects/review.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { codeSearch } from '../code-search/code-search.js';
import './finding-search.js';
import './rejected-findings.js';
import { clockText, kindText, percent, placeText, sizeText, titleOf } from './words.js';

/** Least scores to choose from. */
const SCORES = [0, 0.3, 0.5, 0.7, 0.9];

export class FindingQueue extends Component {
  /** The code that the person has chosen for a finding: {id, code}. */
  #chosen = { id: null, code: null };

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.classList.add('column');
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('findings.title'));
    /** @type {Parts<'finding-queue/finding-queue'>} */
    this.parts = render(
      this,
      html`<div class="queue__head pad-row row wrap apart line-below">
          <p class="number" role="status" data-part="counts"></p>
          <div class="row">
            <select class="input queue__filter" data-part="kind" aria-label="${t('findings.kind')}"></select>
            <select class="input queue__filter" data-part="least" aria-label="${t('findings.least')}">${SCORES.map(
              (score) =>
                html`<option value="${score}">${score ? t('findings.at_least', { score: percent(score) }) : t('findings.any_score')}</option>`,
            )}</select>
          </div>
        </div>
        <finding-search class="line-below"></finding-search>
        <div class="grow scrolls holds">
          <p class="message queue__locked unless-empty" data-part="locked"></p>
          <section class="queue__one pad-3" aria-label="${t('findings.shown')}" data-part="one" hidden>
            <button type="button" class="bare queue__picture" data-part="look" aria-label="${t('findings.look')}"
              title="${t('findings.look')}"><img alt="" data-part="picture" /></button>
            <div class="stack one-column packed">
              <h2 class="queue__title" data-part="title"></h2>
              <dl class="queue__facts" data-part="facts"></dl>
              <div class="queue__code row holds"><label for="finding-code">${t('form.code')}</label>
                <input class="input" id="finding-code" role="combobox" aria-autocomplete="list" aria-expanded="false"
                  aria-controls="finding-codes" aria-describedby="finding-code-label" autocomplete="off" spellcheck="false"
                  placeholder="${t('form.code_hint')}" data-part="code" />
                <span class="help one-line grow shrinks" id="finding-code-label" data-part="label"></span>
                <ul class="code-search__list panel" id="finding-codes" role="listbox" aria-label="${t('form.codes')}" data-part="codes" hidden></ul>
              </div>
            </div>
          </section>
          <p class="pad-4 dim unless-empty" data-part="nothing"></p>
          <rejected-findings></rejected-findings>
        </div>
        <div class="queue__bar flow pad-row line-above" data-part="bar" hidden>
          ${command('accept', 'check', t('findings.accept'), 'A', 'button--primary')}
          ${command('reject', 'close', t('findings.reject'), 'R')}
          ${command('next', 'forward', t('findings.next'), 'N')}
          <span class="spacer"></span>
          <button type="button" class="button button--quiet button--small button--icon" data-part="undo"
            title="${withKey(t('page.undo'), 'U')}" aria-label="${t('page.undo')}">${icon('undo')}</button>
        </div>`,
    );
    const { parts, desk } = this;
    const { findings } = desk;
    codeSearch(parts.code, parts.codes, desk.catalogue, (row) => this.#choose(codeOf(row)));
    this.listen(parts.code, 'change', () => this.#typed());
    this.listen([parts.kind, parts.least], 'change', ({ target }) => {
      findings.filter.set({ kind: parts.kind.value, least: Number(parts.least.value) });
      target.blur(); // the keys are the queue's again
    });
    // A click leaves the keyboard focus with the film.
    this.listen(this, 'mousedown', (event) => event.target.closest('button') && event.preventDefault());
    this.listen(parts.look, 'click', () => desk.lookAt(findings.shown, true));
    this.listen(parts.accept, 'click', () => this.accept());
    this.listen(parts.reject, 'click', () => this.reject());
    this.listen(parts.next, 'click', () => this.next());
    this.listen(parts.undo, 'click', () => this.closest('inspection-page').undo());
    this.listen([findings, findings.current, findings.filter, desk.inspection], 'change', () => this.#show());
    this.listen(desk.history, 'change', () => (parts.undo.disabled = !desk.history.last));
    this.listen(desk.tab, 'change', () => desk.tab.value === 'findings' && this.#look());
    parts.undo.disabled = !desk.history.last;
    this.#show();
    this.#look();
  }

  /** Shows a finding in the film, and here. */
  #look(finding = this.desk.findings.shown) {
    if (finding) this.desk.lookAt(finding);
  }

  // Commands of the keys and buttons ----------------------------------------------------------

  accept() {
    const { findings } = this.desk;
    const { shown } = findings;
    if (!this.#mayDecide() || !shown) return;
    findings.accept(shown, this.#fieldsOf(shown));
    this.#look(findings.next);
  }

  reject() {
    const { findings } = this.desk;
    const { shown } = findings;
    if (!this.#mayDecide() || !shown) return;
    findings.reject(shown.id);
    this.#look(findings.next);
  }

  next() {
    this.#look(this.desk.findings.next ?? undefined);
  }

  #mayDecide() {
    if (!mayEdit()) this.desk.fault(whyLocked());
    return mayEdit();
  }

  /** What the observation begins with; quantities are those of the suggested code. */
  #fieldsOf(finding) {
    const { frame, pixel, suggested, distance_m: m } = finding;
    const code = this.#codeOf(finding);
    const { quant1, quant2, ...others } = suggested;
    return {
      ...others,
      ...(code.code === suggested.code && { quant1, quant2 }),
      ...code,
      frame: frame ?? this.desk.track.frameAtDistance(1000 * m, this.desk.playhead.value.frame),
      pixel,
    };
  }

  #codeOf({ id, suggested: { code = null, char1 = null, char2 = null } }) {
    return this.#chosen.id === id ? this.#chosen.code : { code, char1, char2 };
  }

  #choose(code) {
    this.#chosen = { id: this.desk.findings.shown?.id ?? null, code };
    this.parts.code.blur();
    this.#show();
  }

  /** A code that was typed in full counts without being picked from the list; what is none goes. */
  #typed() {
    const text = this.parts.code.value.trim();
    const row = this.desk.catalogue.typed(text);
    if (row || !text) this.#choose(row ? codeOf(row) : { code: null, char1: null, char2: null });
    else {
      this.desk.fault(t('code.not_found', { text }));
      this.#show();
    }
  }

  // What is shown -----------------------------------------------------------------------------

  #show() {
    const { parts, desk } = this;
    const { findings } = desk;
    if (!findings.value) return;
    const count = (/** @type {'offered'|'accepted'|'rejected'} */ state) => findings.in(state).length;
    const [offered, accepted, rejected] = [count('offered'), count('accepted'), count('rejected')];
    setText(parts.counts, t('findings.counts', { n: offered, accepted, rejected }));
    setText(parts.locked, offered && !mayEdit() ? whyLocked() : '');
    this.#showFilter();
    const { shown } = findings;
    parts.one.hidden = parts.bar.hidden = !shown;
    setText(parts.nothing, shown ? '' : this.#whyNothing(offered, accepted + rejected));
    if (shown) this.#showOne(shown);
  }

  #showFilter() {
    const { parts } = this;
    const { kind } = this.desk.findings.filter.value;
    const kinds = [...new Set(['', kind, ...this.desk.findings.in('offered').map((finding) => finding.kind)])];
    renderNew(
      parts.kind,
      html`${kinds.map((each) => html`<option value="${each}">${each ? kindText(each) : t('findings.all_kinds')}</option>`)}`,
    );
    parts.kind.value = kind;
  }

  #whyNothing(offered, decided) {
    const { state } = this.desk.findings.value.search;
    if (offered) return t('findings.none_pass');
    if (decided) return t('findings.all_decided');
    return state === 'done' ? t('findings.found_nothing') : t('findings.none_yet');
  }

  #showOne(finding) {
    const { parts, desk } = this;
    setText(parts.title, titleOf(finding));
    const facts = [
      [t('findings.place'), placeText(finding)],
      [t('findings.clock'), clockText(finding)],
      [t('findings.size'), sizeText(finding)],
      [t('findings.score'), percent(finding.score)],
    ].filter(([, value]) => value);
    renderNew(
      parts.facts,
      html`${facts.map(([name, value]) => html`<div><dt>${name}</dt><dd class="number">${value}</dd></div>`)}`,
    );
    const picture = `/api/inspections/${desk.inspection.id}/findings/${finding.id}/picture.jpg`;
    if (parts.picture.getAttribute('src') !== picture) parts.picture.src = picture;
    const { code, char1, char2 } = this.#codeOf(finding);
    if (parts.code !== document.activeElement) parts.code.value = [code, char1, char2].filter(Boolean).join(' ');
    setText(parts.label, code ? desk.catalogue.label(code, char1, char2) : t('form.no_code'));
    parts.label.title = parts.label.textContent;
    for (const part of ['accept', 'reject', 'code']) parts[part].disabled = !mayEdit();
  }
}

const command = (part, sign, label, key, kind = '') => html`<button type="button" class="button ${kind}"
  data-part="${part}" title="${withKey(label, key)}">${icon(sign)}${label}<kbd>${ownKey(key)}</kbd></button>`;

customElements.define('finding-queue', FindingQueue);
