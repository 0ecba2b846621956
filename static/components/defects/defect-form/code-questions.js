/** What the code of a defect asks: each answer in short, and the choices of one question at a time, with their keys. */

import { hoursOf } from '../../../core/defects/code-chain.js';
import { answerOf, charChanges, nextOpen, numberIn, questionsOf } from '../../../core/defects/questions.js';
import { html, patchList, render, renderNew, setText } from '../../../core/page/html.js';
import { isKeyOn, isTaken, keyName } from '../../../core/page/keys.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { clockRange } from '../../../core/wall/units.js';
import { GRADES, severityMark, severityWord } from '../../shared/severity-mark/severity-mark.js';
import { unitOf } from './units.js';
import './clock-dial.js';

const LABELS = {
  char1: t('form.kind'),
  char2: t('form.detail'),
  clock: t('dial.label'),
  quant1: t('form.quantity'),
  quant2: t('form.quantity_2'),
  severity: t('form.severity'),
  remark: t('form.remark'),
};
const RATED = /^Shift\+([0-5])$/;
const NUMBERS = ['quant1', 'quant2'];

/**
 * Fires `answer` (detail: the changes) and, when nothing is open any more, `answered` (detail {hadFocus}: whether the
 * cursor was in what is hidden then).
 */
export class CodeQuestions extends Component {
  #item = null;
  /** @type {import('../../../core/defects/questions.js').Question[]} */
  #questions = [];
  /** Name of the question whose choices are shown. */
  #current = null;
  /** What is typed of its answer. */
  #typed = '';
  /** Whether the last key ended the hour of a clock position. */
  #hasTypedHour = false;
  /** Questions that the person has passed over. */
  #passed = new Set();

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'defect-form/code-questions'>} */
    this.parts = render(
      this,
      html`<div class="flow gap-1" role="group" aria-label="${t('ask.label')}" data-part="all"></div>
        <div class="questions__one stack framed pad-2" role="group" tabindex="-1" id="question"
          aria-label="${t('ask.one')}" aria-describedby="question-asked" data-part="one" hidden>
          <p class="row apart"><b class="number" role="status" id="question-asked" data-part="asked"></b>
            <button type="button" class="button button--quiet button--small" data-part="next"><kbd>↵</kbd>${t('ask.next')}</button></p>
          <div class="questions__choices flow gap-1" data-part="choices"></div>
          <clock-dial class="stack" data-part="dial"></clock-dial>
          ${[1, 2].map(
            (n) => html`<div class="field" data-part="quant${n}Field"><span class="input-with-unit"><input class="input"
              name="quant${n}" aria-label="${LABELS[`quant${n}`]}" inputmode="decimal" autocomplete="off"
              aria-describedby="defect-quant${n}-fault" /><span class="unit" data-part="unit${n}"></span></span>
              <span class="fault" id="defect-quant${n}-fault"></span></div>`,
          )}
          <textarea class="input" name="remark" rows="2" maxlength="2000" aria-label="${LABELS.remark}" data-part="remark"></textarea>
        </div>`,
    );
    const { parts } = this;
    this.listen(parts.all, 'click', ({ target }) => {
      const name = target.closest('[data-key]')?.dataset.key;
      if (name) this.#open(name === this.#current ? null : name, { isFocused: true });
    });
    this.listen(parts.next, 'click', () => this.#pass());
    this.listen(parts.choices, 'click', ({ target }) => {
      const choice = target.closest('[data-choice]')?.dataset.choice;
      if (choice !== undefined) this.#choose(choice);
    });
    this.listen(parts.dial, 'pick', ({ detail: { from, to, isDrawn } }) => {
      const wasOpen = this.#question.isOpen;
      this.#answer({ clock_from: from, clock_to: to });
      if (wasOpen && isDrawn) this.#advance();
    });
    // A click leaves the keyboard focus with the film.
    this.listen(this, 'mousedown', (event) => event.target.closest('button') && event.preventDefault());
    // Before the keys of the page: while a question is asked, its answers come first.
    this.listen(document, 'keydown', (event) => this.#key(event), { capture: true });
  }

  /** Shows an observation; the question that is asked stays. */
  show(item) {
    this.#item = item;
    this.#questions = questionsOf(item, this.desk.catalogue);
    if (!this.#question) this.#current = null;
    this.#show();
  }

  /**
   * Asks what is open, one after the other; returns whether anything is.
   * @param {{isFocused?: boolean}} [how] isFocused: the cursor goes there
   */
  ask({ isFocused = false } = {}) {
    // In the 3D view the keys would go on moving its camera.
    if (document.activeElement instanceof HTMLIFrameElement) document.activeElement.blur();
    this.#passed.clear();
    this.#open(nextOpen(this.#questions)?.name ?? null, { isFocused });
    return this.#current !== null;
  }

  get #question() {
    return this.#questions.find(({ name }) => name === this.#current);
  }

  /** @param {string|null} name @param {{isFocused?: boolean, typed?: string}} [how] */
  #open(name, { isFocused = this.contains(document.activeElement), typed = '' } = {}) {
    this.#current = name;
    this.#typed = typed;
    this.#show();
    // Words can be typed into their field alone.
    if (name && (isFocused || name === 'remark')) this.#focus();
  }

  #focus() {
    const { one, remark } = this.parts;
    const field = { quant1: this.#input(1), quant2: this.#input(2), remark }[this.#current];
    if (!field) one.focus({ preventScroll: true });
    field?.focus();
    field?.select();
  }

  #input(n) {
    return this.parts[`quant${n}Field`].querySelector('input');
  }

  #answer(changes) {
    this.dispatchEvent(new CustomEvent('answer', { detail: changes }));
  }

  #choose(value) {
    this.#answer(this.#current === 'severity' ? { severity: Number(value) } : charChanges(this.#current, value));
    this.#advance();
  }

  /** Goes on to the next open question; ends where there is none. */
  #advance() {
    const next = nextOpen(this.#questions, this.#passed);
    const hadFocus = this.contains(document.activeElement);
    this.#open(next?.name ?? null);
    if (!next) this.dispatchEvent(new CustomEvent('answered', { detail: { hadFocus } }));
  }

  #pass() {
    this.#passed.add(this.#current);
    this.#advance();
  }

  /** Returns to the question before, whose answer can be given again. */
  #back() {
    const at = this.#questions.findIndex(({ name }) => name === this.#current);
    const { name } = this.#questions[Math.max(at - 1, 0)];
    this.#passed.delete(name);
    this.#open(name, { typed: NUMBERS.includes(name) ? String(this.#item[name] ?? '') : '' });
  }

  #key(event) {
    const { key, target } = event;
    const { desk } = this;
    if (!this.#current || !mayEdit() || desk.picking.value || desk.measuring.value) return;
    // On some keyboards @ is typed with Alt and Ctrl.
    if (key !== '@' && (event.ctrlKey || event.metaKey || event.altKey)) return;
    const name = keyName(event);
    if (this.contains(target) && target.matches('input, textarea')) {
      const isNumber = target instanceof HTMLInputElement;
      if (name !== 'Enter' && !(isNumber && (key === '@' || RATED.test(name)))) return;
    } else if (isTaken(target, name)) return;
    if (!isKeyOn(name) && !this.closest('defect-form').contains(document.activeElement)) return;
    if (!this.#takes(name, key)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }

  /** Whether a key belongs to the questions; then it has had its effect. */
  #takes(name, key) {
    const grade = RATED.exec(name)?.[1];
    if (grade) {
      this.#answer({ severity: Number(grade) });
      if (!this.#question?.isOpen) this.#advance();
      return true;
    }
    const wasTyped = this.#hasTypedHour;
    this.#hasTypedHour = false;
    // An hour ends by itself, but a hand that has typed a number ends it with Enter.
    if (key === 'Enter' && wasTyped) return true;
    if (key === 'Enter') this.#pass();
    else if (key === 'Backspace' && this.#typed) this.#erase();
    else if (key === 'Backspace') this.#back();
    else if (key === '@' || (key === '.' && !NUMBERS.includes(this.#current))) return this.#askClock();
    else return this.#type(key);
    return true;
  }

  #type(key) {
    const answer = answerOf(this.#question, this.#typed, key);
    if (!answer) return false;
    this.#typed = answer.typed;
    this.#hasTypedHour = answer.isDone && this.#current === 'clock';
    if (answer.changes) this.#answer(answer.changes);
    if (answer.isDone) this.#advance();
    else this.#show();
    return true;
  }

  #erase() {
    this.#typed = this.#typed.slice(0, -1);
    if (NUMBERS.includes(this.#current)) this.#answer({ [this.#current]: numberIn(this.#typed) ?? null });
    if (this.#current === 'clock') this.#answer(hoursOf(this.#typed));
    this.#show();
  }

  /** Asks for the clock position, and after its hour for where it ends. */
  #askClock() {
    if (!this.#questions.some(({ name }) => name === 'clock')) return false;
    const { clock_from: from, clock_to: to } = this.#item;
    this.#open('clock', { typed: from && !to ? `@${from}@` : '@' });
    return true;
  }

  // What is shown -----------------------------------------------------------------------------

  #show() {
    const { parts } = this;
    const item = this.#item;
    patchList(
      parts.all,
      this.#questions,
      ({ name }) => name,
      ({ name }) => this.#createRow(name),
      (row, question) => this.#updateRow(row, question),
    );
    const question = this.#question;
    parts.one.hidden = !question;
    if (!question) return;
    const { name } = question;
    setText(
      parts.asked,
      [LABELS[name], this.#typed && name === 'clock' && this.#clockTyped].filter(Boolean).join(': '),
    );
    renderNew(parts.choices, this.#choices(question));
    parts.choices.hidden = !question.choices && name !== 'severity';
    parts.dial.hidden = name !== 'clock';
    parts.remark.hidden = name !== 'remark';
    const { clock_from: from = null, clock_to: to = null } = item;
    parts.dial.set({ from, to }, this.#measuredHour);
    for (const n of /** @type {const} */ ([1, 2])) {
      parts[`quant${n}Field`].hidden = name !== `quant${n}`;
      setText(parts[`unit${n}`], this.#unit(n));
    }
    if (NUMBERS.includes(name) && this.#typed) this.#input(Number(name.at(-1))).value = this.#typed;
  }

  /** @param {import('../../../core/defects/questions.js').Question} question */
  #choices({ name, choices }) {
    const { severity = null } = this.#item;
    if (name === 'severity') {
      return html`${GRADES.map((grade) => choice(grade, grade === severity, html`${severityMark(grade)}${severityWord(grade)}`))}`;
    }
    const fits = (choices ?? []).filter(({ value }) => value.startsWith(this.#typed));
    return html`${fits.map(({ value, label }) => choice(value, value === this.#item[name], label))}`;
  }

  get #clockTyped() {
    const { clock_from: from, clock_to: to } = hoursOf(this.#typed);
    if (from === null) return t('ask.hour');
    return to === null && this.#typed.endsWith('@') ? t('ask.hour_to', { from }) : clockRange(from, to);
  }

  get #measuredHour() {
    const item = this.#item;
    return this.desk.measuredHour(item) ?? (item.clock_from ? null : (item.clock ?? null));
  }

  #unit(n) {
    const { code, char1, char2 } = this.#item;
    return unitOf(this.desk.catalogue.row(code, char1, char2), n);
  }

  #createRow(name) {
    const row = Object.assign(document.createElement('button'), {
      type: 'button',
      className: 'question tile inline-row gap-1 small shrinks',
    });
    row.setAttribute('aria-controls', 'question');
    row.parts = render(
      row,
      html`<span class="dim">${LABELS[name]}</span><span class="question__answer one-line number" data-part="answer"></span><span
        class="strong weak" data-part="needed">${t('form.needed')}</span>`,
    );
    return row;
  }

  #updateRow(row, question) {
    const { name, isNeeded } = question;
    row.setAttribute('aria-expanded', String(name === this.#current));
    row.classList.toggle('question--needed', isNeeded);
    row.parts.needed.hidden = !isNeeded;
    row.parts.answer.hidden = isNeeded;
    renderNew(row.parts.answer, html`${this.#answerText(question)}`);
    row.title = row.parts.answer.textContent;
  }

  /** @param {import('../../../core/defects/questions.js').Question} question */
  #answerText({ name, choices }) {
    const item = this.#item;
    const { clock_from: from = null, clock_to: to = null, severity = null } = item;
    const value = item[name] ?? null;
    if (name === 'severity') return severity === null ? '–' : html`${severityMark(severity)} ${severity}`;
    if (name === 'clock') {
      if (from !== null) return clockRange(from, to);
      const hour = this.#measuredHour;
      return hour === null ? '–' : t('form.measured', { clock: t('units.clock', { hour }) });
    }
    if (value === null) return '–';
    if (choices) return html`<b>${value}</b> ${choices.find((one) => one.value === value)?.label ?? ''}`;
    return NUMBERS.includes(name) ? `${value} ${this.#unit(Number(name.at(-1)))}` : value;
  }
}

const choice = (value, isChosen, label) =>
  html`<button type="button" class="tile question__choice inline-row gap-1 small" data-choice="${value}" aria-pressed="${String(isChosen)}"><kbd>${value}</kbd>${label}</button>`;

customElements.define('code-questions', CodeQuestions);
