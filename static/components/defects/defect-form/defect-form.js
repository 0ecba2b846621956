/**
 * Details of one observation: what its code asks comes first, the rest is behind "More". Every letter is stored as it
 * is typed; there is no Save button.
 */

import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { withKey } from '../../../core/page/keys.js';
import { recallMembers, remember } from '../../../core/page/remembered.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { codeOf } from '../../../core/defects/codes.js';
import { numberIn } from '../../../core/defects/questions.js';
import { openStretches, partsOf, stretchNumber, stretchRole } from '../../../core/defects/stretches.js';
import { chainage, timecode } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { codeSearch } from '../code-search/code-search.js';
import { intervalText, nameOf, roleText } from '../defect-list/names.js';
import { icon } from '../../shared/icon/icon.js';
import { copyLink } from '../../desk/actions/links.js';
import {
  changeStretch,
  dissolveStretch,
  finishStretch,
  joinPoints,
  otherEnd,
  startStretchAt,
} from '../../desk/actions/stretches.js';
import '../../film/measure/measure-box.js';
import '../attachments/defect-attachments.js';
import '../../desk/panels/defect-review.js';
import './code-questions.js';
import './quick-key.js';

/** Fields for text, and fields for a number of 0 or more. */
const TEXTS = ['remark', 'recommendation'];
const NUMBERS = ['quant1', 'quant2', 'cost'];
/** Whether a person has left More open. */
const REMEMBERED = 'chainage.form';

export class DefectForm extends Component {
  /** @type {string} */
  observationId;

  /** A new object for every visit of a field: everything typed meanwhile is one undo step. */
  #visit = {};
  /**
   * By text field, the stored value that it last showed or stated. The field with the focus does not follow the
   * store: what is typed there changes this value, not one that somebody else has stored meanwhile.
   */
  #seen = {};
  /** What the proposals on offer depend on. */
  #proposedFor = [];
  /** Whether a change of the observation was refused when the form was last filled. */
  #wasRefused = false;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'defect-form/defect-form'>} */
    this.parts = render(
      this,
      html`<div class="form__head row gap-3 apart line-below">
          <h2 data-part="title"></h2>
          <button type="button" class="button button--quiet button--small button--icon" data-part="link"
            title="${withKey(t('link.copy'), 'Y')}" aria-label="${t('link.copy')}">${icon('link')}</button>
          <button type="button" class="button button--small" data-part="done" title="${t('form.close')}">${icon('check')}${t('form.done')}</button>
        </div>
        <p class="form__others line-below small" role="status" data-part="others" hidden></p>
        <form class="form__body stack one-column packed grow" data-part="form">
          <div class="message message--error" role="alert" data-part="refused" hidden>${icon('alert')}
            <div><p data-part="refusal"></p><div class="flow">
              <button type="button" class="button button--small" data-part="compare">${icon('swap')}${t('conflict.compare')}</button>
              <button type="button" class="button button--small" data-part="again">${icon('retry')}${t('form.send_again')}</button>
              <button type="button" class="button button--small" data-part="giveUp">${icon('undo')}${t('form.give_up')}</button>
            </div></div></div>
          <fieldset class="locked" ${!mayEdit() && 'disabled'}>
          <div class="form__code row holds">
            <label for="defect-code">${t('form.code')}</label>
            <input class="input" id="defect-code" role="combobox" aria-autocomplete="list" aria-expanded="false"
              aria-controls="defect-codes" aria-describedby="needs-code defect-code-label" autocomplete="off" spellcheck="false"
              placeholder="${t('form.code_hint')}" data-part="code" />
            <span class="small strong weak" id="needs-code" data-part="codeNeeded" hidden>${t('form.needed')}</span>
            <span class="help grow shrinks" id="defect-code-label" data-part="label"></span>
            <span class="help unless-empty" role="status" data-part="grade"></span>
            <ul class="code-search__list panel" id="defect-codes" role="listbox" aria-label="${t('form.codes')}" data-part="codes" hidden></ul>
          </div>
          <code-questions class="stack" data-part="questions"></code-questions>
          </fieldset>
          <details class="more" data-part="more"><summary>${t('form.more')}</summary>
            <div class="form__more stack gap-3">
              <fieldset class="locked" ${!mayEdit() && 'disabled'}>
              <section class="stack" aria-label="${t('stretch.label')}" data-part="stretchField">
                <p class="number" data-part="stretch"></p>
                <div class="flow" data-part="stretchButtons"></div>
              </section>
              <measure-box data-part="measures"></measure-box>
              <section class="stack gap-3" aria-label="${t('form.advice')}">
                <div class="field"><label for="defect-recommendation">${t('form.recommendation')}</label>
                  <select class="input" data-part="proposals" aria-label="${t('form.proposals')}" hidden></select>
                  <textarea class="input" id="defect-recommendation" name="recommendation" rows="2" maxlength="1000"></textarea></div>
                <div class="field form__cost" data-part="costField"><label for="defect-cost">${t('form.cost')}</label>
                  <span class="input-with-unit"><input class="input" id="defect-cost" name="cost" inputmode="decimal"
                    autocomplete="off" aria-describedby="defect-cost-fault" /><span class="unit" data-part="currency"></span></span>
                  <span class="fault" id="defect-cost-fault" data-part="costFault"></span></div>
              </section>
              <quick-key data-part="quickKey"></quick-key>
              </fieldset>
              <section class="form__place stack at-start" aria-label="${t('form.place')}">
                <p class="help number" data-part="anchor"></p>
                <button type="button" class="button button--small" data-part="move" data-needs="operator" title="${t('form.move_help')}">${icon('move')}${t('form.move')}</button>
                <defect-attachments class="stack shrinks" data-part="attachments"></defect-attachments>
              </section>
              <defect-review></defect-review>
            </div></details>
        </form>`,
    );
    const { parts, desk } = this;
    this.elements = parts.form.elements;
    codeSearch(parts.code, parts.codes, desk.catalogue, (row) => this.#pickCode(row));
    this.listen(parts.done, 'click', () => desk.editing.set(false));
    this.listen(parts.link, 'click', () => copyLink(desk));
    this.listen(parts.compare, 'click', () => desk.conflicts.open(desk.conflicts.about(this.observationId)));
    this.listen(parts.again, 'click', () => desk.observations.sendAgain(this.observationId));
    this.listen(parts.giveUp, 'click', () => desk.observations.giveUp(this.observationId));
    this.listen(parts.move, 'click', () => desk.moveHere());
    this.listen(parts.stretchButtons, 'click', ({ target }) => {
      const button = target.closest('[data-do]');
      if (button) this.#stretch(button.dataset.do);
    });
    this.listen(parts.proposals, 'change', () => this.#accept(Number(parts.proposals.value)));
    this.listen(parts.questions, 'answer', ({ detail }) => this.#store(detail));
    this.listen(parts.questions, 'answered', ({ detail }) => this.#answered(detail));
    this.listen(desk.playhead, 'change', () => {
      if (desk.hasMovedOn && !this.contains(document.activeElement)) desk.editing.set(false);
    });
    this.listen(desk.asking, 'change', () => desk.asking.value && this.#ask());
    this.listen(parts.more.querySelector('summary'), 'click', () => remember(REMEMBERED, { isOpen: !parts.more.open }));
    this.listen(parts.form, 'submit', (event) => {
      event.preventDefault();
      desk.editing.set(false);
    });
    this.listen(parts.form, 'focusin', () => (this.#visit = {}));
    this.listen(parts.form, 'input', ({ target }) => this.#typed(target));
    this.listen(parts.code, 'change', () => this.#leftCode());
    this.listen(parts.form, 'change', ({ target }) => this.#changed(target));
    this.listen(parts.form, 'focusout', ({ target }) => isWrong(target) || this.#fill());
    // Escape leaves the field and closes the form; on the page it would drop the selection, too.
    this.listen(this, 'keydown', (event) => {
      if (event.key !== 'Escape') return;
      event.stopPropagation();
      desk.editing.set(false);
    });
    for (const store of [desk.observations, desk.track, desk.conflicts, desk.proposals]) {
      this.listen(store, 'change', () => this.#fill());
    }
    desk.proposals.loadPatiently();
    this.listen(desk.people, 'change', () => this.#showOthers());
    this.listen(desk.measuring, 'change', () => (parts.more.open ||= desk.measuring.value !== null));
    this.#fill();
    this.#showOthers();
    parts.more.open = recallMembers(REMEMBERED, { isOpen: false }).isOpen || this.#hasMore;
    if (desk.asking.value) this.#ask();
  }

  /**
   * Puts the cursor on what is missing, else on the code, and scrolls to the form where it is below the film, as the
   * person opened it.
   */
  enter() {
    const { code, questions } = this.parts;
    if (!questions.ask({ isFocused: true })) {
      code.focus({ preventScroll: true });
      code.select();
    }
    this.scrollIntoView({ block: 'nearest' });
  }

  /** Asks what is open; of a tag that was just made the keys answer, and the film keeps the focus. */
  #ask() {
    const { questions, code, codeNeeded } = this.parts;
    const isFocused = this.desk.asking.value === 'all';
    if (questions.ask({ isFocused })) return;
    if (isFocused && !codeNeeded.hidden) code.focus();
    else this.desk.askNext();
  }

  #answered({ hadFocus }) {
    const { desk } = this;
    if (hadFocus) this.parts.done.focus();
    if (desk.asking.value) desk.askNext();
  }

  /** Whether anything behind More has a value, or is wanted as the inspection is under review. */
  get #hasMore() {
    const item = this.#item;
    const { review, inspection } = this.desk;
    const isStated = [item?.recommendation, item?.cost ?? null, item?.measures, item?.continuous].some(
      (value) => value !== null && value !== undefined,
    );
    const isReviewed = review.about(this.observationId).length > 0 || inspection.value.review.state !== 'draft';
    return isStated || isReviewed;
  }

  get #item() {
    return this.desk.observations.find(this.observationId);
  }

  #showOthers() {
    const { others } = this.parts;
    const names = this.desk.people.editing(this.observationId);
    others.hidden = names.length === 0;
    setText(others, names.length ? t('people.editing', { n: names.length, names: names.join(', ') }) : '');
  }

  #save(changes) {
    this.desk.observations.edit(this.observationId, changes, this.#state(changes));
  }

  /** Notes what the text fields of a change state from now on; returns what they stated before. */
  #state(changes) {
    const names = Object.keys(changes).filter((name) => name in this.#seen);
    const before = Object.fromEntries(names.map((name) => [name, this.#seen[name]]));
    for (const name of names) this.#seen[name] = changes[name];
    return before;
  }

  #pickCode(row) {
    this.parts.code.value = row.code;
    this.#save(codeOf(row));
    this.parts.questions.ask({ isFocused: true });
  }

  /** Stores an answer: all of one visit are one step to undo; a severity is one of its own, as by its keys. */
  #store(changes) {
    this.desk.noteAnswer();
    if ('severity' in changes) this.#save(changes);
    else this.desk.observations.type(this.observationId, changes, this.#visit, this.#state(changes));
  }

  /** Handles typing in a field; a choice reports `change` instead. */
  #typed(field) {
    const changes = field === this.parts.code ? this.#codeTyped : this.#textTyped(field);
    if (changes) this.#store(changes);
  }

  /** Whether a code is typed in full, 'BAB' or 'bab b a': it counts without being picked from the list. */
  get #codeTyped() {
    const text = this.parts.code.value.trim();
    if ([this.#item.code, this.#seen.code].some((code) => text.toUpperCase() === (code ?? ''))) return null;
    const row = this.desk.catalogue.typed(text);
    return row && codeOf(row);
  }

  #textTyped({ name, value }) {
    if (TEXTS.includes(name)) return { [name]: value.trim() || null };
    if (!NUMBERS.includes(name)) return null;
    const number = numberIn(value);
    return number === undefined ? null : { [name]: number };
  }

  #leftCode() {
    const { code } = this.parts;
    const text = code.value.trim();
    if (text && !this.desk.catalogue.typed(text)) this.desk.fault(t('code.not_found', { text }));
    if (!text && this.#seen.code !== null) this.#save({ code: null, char1: null, char2: null });
    this.#put('code', code, this.#item?.code, true);
  }

  #changed({ name, value }) {
    if (NUMBERS.includes(name)) {
      const number = numberIn(value);
      const isFault = number === undefined;
      this.#fault(name).textContent = isFault ? t('form.quantity_fault') : '';
      this.elements.namedItem(name).setAttribute('aria-invalid', String(isFault));
      if (!isFault) this.#left(name, number);
    } else if (TEXTS.includes(name)) this.#left(name, value.trim() || null);
  }

  #fault(name) {
    return this.querySelector(`#defect-${name}-fault`);
  }

  /** Saves the value of a text field that is left, unless it is what the field stated before. */
  #left(name, value) {
    if (value !== this.#seen[name]) this.#save({ [name]: value });
  }

  #stretch(what) {
    const { desk } = this;
    const item = this.#item;
    const number = stretchNumber(item);
    if (what === 'start') startStretchAt(desk, item);
    if (what === 'join') joinPoints(desk, otherEnd(desk, item), item);
    if (what === 'finish') finishStretch(desk, number);
    if (what === 'change') changeStretch(desk, number);
    if (what === 'dissolve') dissolveStretch(desk, item);
  }

  /** Shows the observation, except in the field in which the person is typing: unless what was typed was discarded. */
  #fill() {
    const item = this.#item;
    if (!item) return;
    const { parts, elements } = this;
    const isDiscarded = this.#wasRefused && item.save === 'saved';
    this.#wasRefused = item.save === 'refused';
    const { catalogue } = this.desk;
    parts.title.textContent = `${nameOf(item)} ${intervalText(item)}`;
    parts.refused.hidden = item.save !== 'refused';
    const isOvertaken = this.desk.conflicts.about(item.id) !== undefined;
    parts.compare.hidden = !isOvertaken;
    parts.again.hidden = parts.giveUp.hidden = isOvertaken; // Compare replaces these two
    parts.refusal.textContent = item.save === 'refused' ? t('defects.refused', { reason: item.refusal }) : '';
    this.#put('code', parts.code, item.code, isDiscarded);
    parts.label.textContent = item.code ? catalogue.label(item.code, item.char1, item.char2) : t('form.no_code');
    const grade = catalogue.grade(item);
    setText(parts.grade, grade === null ? '' : t('settings.pack_graded', { grade }));
    parts.codeNeeded.hidden = Boolean(item.code) && catalogue.has(item.code);
    parts.quickKey.show(item);
    for (const name of [...TEXTS, ...NUMBERS]) this.#put(name, elements.namedItem(name), item[name], isDiscarded);
    parts.questions.show(item);
    this.#fillAdvice(item);
    parts.measures.set(item);
    this.#fillStretch(item);
    parts.anchor.textContent = anchorText(item);
  }

  /** Offers the proposals for the defect; the cost is asked where the project wants costs. */
  #fillAdvice(item) {
    const { parts, desk } = this;
    const { costs, currency } = desk.proposals.value;
    parts.costField.hidden = !costs && (item.cost ?? null) === null;
    parts.currency.textContent = currency;
    const proposedFor = [item.code, item.char1, item.severity, desk.proposals.value];
    if (proposedFor.every((value, i) => value === this.#proposedFor[i])) return;
    this.#proposedFor = proposedFor;
    const proposals = desk.proposals.of(item);
    parts.proposals.hidden = proposals.length === 0;
    render(
      parts.proposals,
      html`<option value="">${t('form.propose')}</option>${proposals.map(
        ({ text, cost }, i) => html`<option value="${i}">
        ${costs && cost !== null ? `${text} (${cost} ${currency})` : text}</option>`,
      )}`,
    );
  }

  /** Takes a proposal over, as one step that can be undone; the person may go on writing in it. */
  #accept(number) {
    const { parts, desk } = this;
    const { text, cost } = desk.proposals.of(this.#item)[number];
    parts.proposals.value = '';
    this.#save({ recommendation: text, ...(desk.proposals.value.costs && cost !== null && { cost }) });
    this.elements.namedItem('recommendation').focus();
  }

  #fillStretch(item) {
    const { parts, desk } = this;
    const number = stretchNumber(item);
    const rules = desk.catalogue.row(item.code, item.char1, item.char2);
    parts.stretchField.hidden = number === null && rules !== null && !rules.continuous_allowed;
    parts.stretch.textContent = number === null ? t('stretch.is_point') : stretchText(desk, item);
    const other = otherEnd(desk, item);
    const isOpen = openStretches(desk.observations.value).some((stretch) => Number(stretch.number) === number);
    /** @type {[string, import('../../shared/icon/icon.js').IconName, string, string][]} what, sign, label, key */
    const buttons =
      number === null
        ? [
            ['start', 'stretch', t('stretch.start_at', { where: chainage(item.distance_m) }), ''],
            other && ['join', 'stretch', t('stretch.join', { where: chainage(other.distance_m) }), ''],
          ]
        : [
            isOpen && ['finish', 'check', t('stretch.finish'), 'F'],
            isOpen && ['change', 'edit', t('stretch.change'), 'C'],
            ['dissolve', 'close', t('stretch.dissolve'), ''],
          ];
    renderNew(
      parts.stretchButtons,
      html`${buttons.filter(Boolean).map(
        ([what, sign, label, key]) => html`<button type="button"
        class="button button--small" data-do="${what}" title="${withKey(label, key)}">${icon(sign)}${label}</button>`,
      )}`,
    );
  }

  /** Shows a stored value in a text field; `isAlways`: even while the person is in it. */
  #put(name, field, value = null, isAlways = false) {
    if (field === document.activeElement && !isAlways) return;
    field.value = value ?? '';
    this.#seen[name] = value;
  }
}

/** Whether a field holds a text that is not allowed, for the person to correct. */
const isWrong = (field) => field.getAttribute('aria-invalid') === 'true';

/**
 * @param {import('../../desk/page/desk.js').Desk} desk
 * @param {import('../../../core/defects/observations.js').Observation} item
 */
function stretchText({ observations, hereM }, item) {
  const parts = partsOf(observations.value, item);
  const [start, finish] = ['A', 'B'].map((role) => parts.find((part) => stretchRole(part) === role));
  const role = roleText(item);
  if (!start) return t('stretch.without_start', { role });
  if (start.distance_m === null) return role;
  const end = finish?.distance_m ?? hereM ?? start.distance_m;
  const length = chainage(Math.abs(end - start.distance_m));
  return finish ? t('stretch.length', { role, length }) : t('stretch.length_so_far', { role, length });
}

/** @param {import('../../../core/defects/observations.js').Observation} item */
function anchorText({ frame, time_s: time, pixel, joint_no: joint, at_joint: isAtJoint, photo_error: photoError }) {
  return [
    t('form.frame', { frame }),
    time !== undefined && time !== null && timecode(time),
    pixel && t('form.pixel', { pixel: pixel.map(Math.round).join(', ') }),
    isAtJoint && joint && t('form.at_joint', { joint }),
    photoError && t('form.no_photo', { reason: photoError }),
  ]
    .filter(Boolean)
    .join(' · ');
}

customElements.define('defect-form', DefectForm);
