/** Details of one observation. Every field is saved as soon as it is left; there is no Save button. */

import { html, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { clockHour, metres, plusMinus, timecode } from '../../core/units.js';
import { icon } from '../icon/icon.js';
import { SEVERITIES, severityMark } from '../severity-mark/severity-mark.js';
import { codeSearch } from './code-search.js';

const HOURS = Array.from({ length: 12 }, (_, i) => i + 1);
const UNIT_WORDS = { deg: '°', count: 'pieces' };

class DefectForm extends Component {
  /** @type {string} */
  observationId;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.parts = render(
      this,
      html`<div class="form__head">
          <h2 data-part="title"></h2>
          <button type="button" class="button button--small" data-part="done" title="Close (Esc)">${icon('check')}Done</button>
        </div>
        <form class="form__body" data-part="form">
          <div class="field form__code">
            <label for="defect-code">Code</label>
            <input class="input" id="defect-code" role="combobox" aria-autocomplete="list" aria-expanded="false"
              aria-controls="defect-codes" aria-describedby="defect-code-label" autocomplete="off" spellcheck="false"
              placeholder="Type letters or a word, such as crack" data-part="code" />
            <ul class="form__codes panel" id="defect-codes" role="listbox" aria-label="Codes" data-part="codes" hidden></ul>
            <span class="help form__label" id="defect-code-label" data-part="label"></span>
          </div>
          <div class="field form__kind" data-part="char1Field"><label for="defect-char1">Kind</label>
            <select class="input" id="defect-char1" name="char1" data-part="char1"></select></div>
          <div class="field" data-part="char2Field"><label for="defect-char2">Detail</label>
            <select class="input" id="defect-char2" name="char2" data-part="char2"></select></div>
          <fieldset class="form__severity">
            <legend>Severity</legend>
            <div class="form__grades">${SEVERITIES.map((word, grade) => html`<label title="${word}">
              <input type="radio" name="severity" value="${grade}" />
              ${severityMark(grade)}<b>${grade}</b></label>`)}</div>
            <span class="help" data-part="severityWord"></span>
          </fieldset>
          <div class="field"><label for="defect-from">Clock from</label>
            <select class="input" id="defect-from" name="clock_from" data-part="from"></select></div>
          <div class="field"><label for="defect-to">Clock to</label>
            <select class="input" id="defect-to" name="clock_to">${hours('one position')}</select></div>
          ${[1, 2].map((n) => html`<div class="field" data-part="quant${n}Field">
            <label for="defect-quant${n}">Quantity${n === 2 && ' 2'}</label>
            <span class="input-with-unit"><input class="input" id="defect-quant${n}" name="quant${n}" inputmode="decimal"
              autocomplete="off" aria-describedby="defect-quant${n}-fault" /><span class="unit" data-part="unit${n}"></span></span>
            <span class="fault" id="defect-quant${n}-fault" data-part="quant${n}Fault"></span></div>`)}
          <div class="field form__wide"><label for="defect-remark">Remark</label>
            <textarea class="input" id="defect-remark" name="remark" rows="2" maxlength="2000"></textarea></div>
          <p class="help form__wide number" data-part="anchor"></p>
        </form>`,
    );
    const { parts } = this;
    const { elements } = parts.form;
    codeSearch(parts.code, parts.codes, this.desk.catalogue, ({ code, char1, char2 }) => {
      parts.code.value = code;
      this.#save({ code, char1: char1 || null, char2: char2 || null });
    });
    this.listen(parts.done, 'click', () => this.desk.editing.set(false));
    this.listen(parts.form, 'submit', (event) => {
      event.preventDefault();
      this.desk.editing.set(false);
    });
    this.listen(parts.code, 'change', () => this.#typedCode());
    this.listen(parts.form, 'change', ({ target }) => this.#changed(target));
    // While typing the keys belong to the field; Escape leaves it, and the form with it.
    this.listen(this, 'keydown', (event) => {
      if (event.key === 'Escape') this.desk.editing.set(false);
    });
    this.listen(this.desk.observations, 'change', () => this.#fill());
    this.elements = elements;
    this.#fill();
    parts.code.focus({ preventScroll: true });
    parts.code.select();
  }

  get #item() {
    return this.desk.observations.find(this.observationId);
  }

  #save(changes) {
    this.desk.observations.edit(this.observationId, changes);
  }

  /** A code that is typed out in full counts without being picked from the list. */
  #typedCode() {
    const code = this.parts.code.value.trim().toUpperCase();
    if (code === (this.#item.code ?? '')) return;
    if (code === '' || this.desk.catalogue.has(code)) this.#save({ code: code || null, char1: null, char2: null });
    else this.#fill();
  }

  #changed({ name, value }) {
    if (!name) return;
    if (name.startsWith('quant')) {
      const number = value.trim() === '' ? null : Number(value.replace(',', '.'));
      const isWrong = Number.isNaN(number) || number < 0;
      this.parts[`${name}Fault`].textContent = isWrong ? 'A number from 0 on is needed.' : '';
      this.elements.namedItem(name).setAttribute('aria-invalid', String(isWrong));
      if (!isWrong) this.#save({ [name]: number });
    } else if (name === 'severity' || name.startsWith('clock')) {
      this.#save({ [name]: value === '' ? null : Number(value) });
    } else if (name === 'char1') {
      this.#save({ char1: value || null, char2: null });
    } else {
      this.#save({ [name]: value.trim() || null });
    }
  }

  /** Shows the observation, leaving alone the field that is being typed in. */
  #fill() {
    const item = this.#item;
    if (!item) return;
    const { parts, elements } = this;
    const { catalogue } = this.desk;
    parts.title.textContent = `${item.code || 'Tag'} at ${metres(item.distance_m)} ${plusMinus(item.distance_u95_m)}`;
    this.#put(parts.code, item.code ?? '');
    parts.label.textContent = item.code
      ? catalogue.label(item.code, item.char1, item.char2)
      : 'A tag without a code is kept, but cannot be reported.';
    this.#offer('char1', catalogue.firstChars(item.code), item.char1);
    this.#offer('char2', catalogue.secondChars(item.code, item.char1), item.char2);
    const rules = catalogue.row(item.code, item.char1, item.char2);
    for (const n of [1, 2]) {
      const value = item[`quant${n}`] ?? null;
      const isNeeded = (rules?.[`needs_q${n}`] ?? 'no') !== 'no';
      parts[`quant${n}Field`].hidden = !isNeeded && value === null;
      const unit = rules?.[`unit_q${n}`] ?? '';
      parts[`unit${n}`].textContent = UNIT_WORDS[unit] ?? unit;
      this.#put(elements.namedItem(`quant${n}`), value === null ? '' : String(value));
    }
    const grade = item.severity ?? null;
    for (const radio of elements.namedItem('severity')) radio.checked = radio.value === String(grade);
    parts.severityWord.textContent = grade === null ? 'not rated' : SEVERITIES[grade];
    const measured = item.clock ? `measured: ${clockHour(item.clock)}` : 'not given';
    render(parts.from, hours(measured));
    this.#put(parts.from, String(item.clock_from ?? ''));
    this.#put(elements.namedItem('clock_to'), String(item.clock_to ?? ''));
    this.#put(elements.namedItem('remark'), item.remark ?? '');
    parts.anchor.textContent = anchorText(item);
  }

  #offer(name, choices, value) {
    const select = this.parts[name];
    this.parts[`${name}Field`].hidden = choices.length === 0;
    render(
      select,
      html`<option value="">Not stated</option>${choices.map((choice) => html`<option value="${choice.value}">
        ${choice.value} – ${choice.label}</option>`)}`,
    );
    select.value = value ?? '';
  }

  #put(field, value) {
    if (field !== document.activeElement || field instanceof HTMLSelectElement) field.value = value;
  }
}

const hours = (none) =>
  html`<option value="">${none}</option>${HOURS.map((hour) => html`<option value="${hour}">${hour}</option>`)}`;

function anchorText({ frame, time_s: time, pixel, joint_no: joint, at_joint: isAtJoint, photo_error: photoError }) {
  return [
    `Frame ${frame}`,
    time !== undefined && time !== null && timecode(time),
    pixel && `pixel ${pixel.map(Math.round).join(', ')}`,
    isAtJoint && joint && `at joint ${joint}`,
    photoError && `no photo: ${photoError}`,
  ]
    .filter(Boolean)
    .join(' · ');
}

customElements.define('defect-form', DefectForm);
