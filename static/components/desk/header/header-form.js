/**
 * The header: the fields that the server lists, in three groups: required for a report, filled in
 * automatically, and more. An empty required field blocks nothing here; it is counted and named.
 *
 * Events: `field` (detail {name, value, before}) when a field is left with a new, valid value, and `typing`
 * (same detail) at every letter before that; `before` is the value that the field showed. `suggested`: `suggest` has
 * filled fields.
 */

import { get, refusalIn } from '../../../core/server/api.js';
import { offered, projectOf } from '../../../core/defects/packs.js';
import { html, render, renderNew, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import '../../assets/asset-note/asset-note.js';
import { message } from '../../shared/message/message.js';
import { fillFromRegister } from './asset-fields.js';
import { fieldMarkup, read, written } from './fields.js';

const REFERENCE_POINTS = [
  t('header.reference_headwall'),
  t('header.reference_manhole'),
  t('header.reference_wall'),
  t('header.reference_pipe_end'),
];

/** Fields that are required only with certain values of another one; the server has the rule. */
const NEEDED_IF = {
  width_mm: ({ shape }) => Boolean(shape) && shape !== 'circular',
  abandon_reason: ({ end_condition: end }) => end === 'abandoned',
};

/** A field that stands after a required one although it is not required: the joints of the pipe give the scale. */
const BESIDE = { material: 'unit_length_m' };

export class HeaderForm extends Component {
  /** Names of fields that are not shown here. */
  without = new Set();

  #fields = [];
  /** Versions of code packs. */
  #packs = [];
  #built = Promise.resolve();
  #values = {};
  /** Values written by `suggest`: a later suggestion may replace them, but not a person's entry. */
  #suggested = {};
  /** Values that are offered beside their fields. */
  #proposed = {};
  /** The value of each field before the person typed in it. */
  #shown = {};

  mount() {
    render(this, html`<p class="dim" role="status">${t('page.loading')}</p>`);
    this.#built = this.#build();
  }

  /** The header in the form of the API, without empty fields; null stands for one that was emptied. */
  get value() {
    return Object.fromEntries(Object.entries(this.#values).filter(([, value]) => value !== ''));
  }

  /** All values, suggestions included. @returns {Record<string, unknown>} */
  get all() {
    return { ...this.#values };
  }

  /** The values that are no suggestions. */
  get entered() {
    return Object.fromEntries(Object.entries(this.#values).filter(([name, value]) => value !== this.#suggested[name]));
  }

  /** Fills the fields, except the one in which the person is typing. */
  set value(header) {
    this.#values = { ...header };
    for (const field of this.#fields) this.#write(field);
    this.#count();
  }

  /** Fills fields that are empty or hold an earlier suggestion. */
  suggest(values) {
    for (const [name, value] of Object.entries(values)) {
      const now = this.#values[name] ?? null;
      const isOurs = now === null || now === '' || now === this.#suggested[name];
      if (!isOurs || value === undefined) continue;
      this.#suggested[name] = value;
      this.#values[name] = value;
      const field = this.#fields.find((other) => other.name === name);
      if (field) this.#write(field);
    }
    this.#count();
    this.dispatchEvent(new Event('suggested'));
  }

  /** Enters values as if the person had done so; null empties a field. */
  state(values) {
    for (const [name, value] of Object.entries(values)) {
      const before = this.#values[name] ?? null;
      if (value === before) continue;
      this.#values[name] = value;
      delete this.#suggested[name];
      this.restore(name);
      this.fault(name, null);
      this.dispatchEvent(new CustomEvent('field', { detail: { name, value, before } }));
    }
    this.#count();
  }

  /** Offers values beside their fields, which a person may take. */
  propose(values) {
    this.#proposed = values;
    this.#showProposals();
  }

  #showProposals() {
    if (!this.parts) return;
    for (const field of this.#fields) {
      const proposal = this.querySelector(`[data-proposes="${field.name}"]`);
      const value = this.#proposed[field.name] ?? null;
      proposal.hidden = value === null || value === this.#values[field.name];
      if (!proposal.hidden) proposal.textContent = t('header.from_film', { value: written(field, value) });
    }
  }

  /** Takes a proposal as if the person had typed it. */
  async #take(name) {
    await this.enter(name, this.#proposed[name]);
    this.#input(name).focus();
  }

  /** Enters a value as if the person had typed it, so that the register fills in what it knows of an asset. */
  async enter(name, value) {
    await this.#built;
    const input = this.#input(name);
    input.value = written(this.#fieldOf(input), value);
    input.dispatchEvent(new Event('change', { bubbles: true }));
  }

  /** Shows a fault beside a field; null removes it. */
  fault(name, sentence) {
    const input = this.#input(name);
    if (!input) return;
    input.setAttribute('aria-invalid', String(sentence !== null));
    input.closest('.field').querySelector('.fault').textContent = sentence ?? '';
  }

  /** Shows the value of a field, even while it has the focus. */
  restore(name) {
    const field = this.#fields.find((other) => other.name === name);
    if (field) this.#show(field, this.#input(name));
  }

  /** Scrolls to a field and focuses it. */
  async goTo(name) {
    await this.#built;
    const input = this.#input(name);
    if (!input) return;
    const group = input.closest('details');
    if (group) group.open = true;
    input.focus();
  }

  async #build() {
    try {
      const parts = ['header-fields', 'packs'].map((part) => get(`/api/${part}`, this.signal));
      const [{ fields }, known] = await Promise.all(parts);
      this.#packs = known.packs;
      this.#fields = fields.filter(({ name }) => !this.without.has(name));
    } catch (error) {
      const refusal = refusalIn(error);
      if (refusal) render(this, html`<div role="alert">${message('error', errorText(refusal))}</div>`);
      return;
    }
    const isBeside = ({ name }) => Object.values(BESIDE).includes(name);
    const group = (name) =>
      html`<div class="header-form__grid stack gap-4">${this.#fields
        .filter((field) => field.group === name && !isBeside(field))
        .flatMap((field) => [field, ...this.#fields.filter((other) => other.name === BESIDE[field.name])])
        .map((field) => fieldMarkup(field))}</div>`;
    /** @type {Parts<'header/header-form'>} */
    this.parts = render(
      this,
      html`<fieldset class="header-form__group">
          <legend>${t('header.required')}</legend>
          <p class="help header-form__missing" role="status" data-part="missing"></p>
          ${group('required')}
        </fieldset>
        <details class="header-form__group"><summary>${t('header.auto')}</summary>${group('auto')}</details>
        <details class="header-form__group"><summary>${t('header.more')}</summary>${group('more')}</details>
        <datalist id="header-references">
          ${REFERENCE_POINTS.map((point) => html`<option value="${point}"></option>`)}
        </datalist>
        <datalist id="header-assets" data-part="assets"></datalist>`,
    );
    this.listen(this, 'input', ({ target }) => this.#typing(target));
    this.listen(this, 'change', ({ target }) => this.#left(target));
    this.listen(this, 'click', ({ target }) => target.dataset.proposes && this.#take(target.dataset.proposes));
    const asset = this.#input('asset_id');
    const note = document.createElement('asset-note');
    asset.closest('.field').after(note);
    note.follow(asset, this.parts.assets);
    fillFromRegister(this, note);
    for (const field of this.#fields) this.#write(field);
    this.#count();
  }

  #input(name) {
    return this.querySelector(`[data-field="${name}"]`);
  }

  #write(field) {
    const input = this.#input(field.name);
    if (input && input !== document.activeElement) this.#show(field, input);
  }

  #show(field, input) {
    this.#shown[field.name] = this.#values[field.name] ?? null;
    input.value = written(field, this.#shown[field.name]);
  }

  #fieldOf(input) {
    return this.#fields.find(({ name }) => name === input.dataset.field);
  }

  #typing(input) {
    const field = this.#fieldOf(input);
    const value = field && read(field, input.value);
    if (value === undefined) return; // not a number yet
    const before = this.#shown[field.name];
    this.dispatchEvent(new CustomEvent('typing', { detail: { name: field.name, value, before } }));
  }

  #left(input) {
    const field = this.#fieldOf(input);
    if (!field) return;
    const value = read(field, input.value);
    this.fault(field.name, value === undefined ? t('header.fault_number') : null);
    if (value === undefined) return;
    this.#values[field.name] = value;
    delete this.#suggested[field.name];
    this.#count();
    const before = this.#shown[field.name];
    this.#shown[field.name] = value;
    this.dispatchEvent(new CustomEvent('field', { detail: { name: field.name, value, before } }));
  }

  /** Offers the code packs of the project. */
  #offerPacks() {
    const select = this.#input('code_pack');
    if (!select) return;
    const { code_pack: kept } = this.#values;
    const packs = offered(this.#packs, projectOf(this.#values), kept);
    renderNew(
      select,
      html`<option value="">${t('settings.pack_built_in')}</option>
        ${packs.map(({ id, name }) => html`<option value="${id}">${name}</option>`)}`,
    );
    select.value = kept ?? '';
  }

  #isNeeded({ name, group }) {
    return NEEDED_IF[name]?.(this.#values) ?? group === 'required';
  }

  /** Marks the required fields and names the empty ones. */
  #count() {
    if (!this.parts) return;
    this.#showProposals();
    this.#offerPacks();
    const missing = [];
    for (const field of this.#fields) {
      const isNeeded = this.#isNeeded(field);
      const value = this.#values[field.name] ?? '';
      const isMissing = isNeeded && value === '';
      if (isMissing) missing.push(wordFor('header', field.name) ?? field.name);
      const input = this.#input(field.name);
      input.setAttribute('aria-required', String(isNeeded));
      const box = input.closest('.field');
      box.classList.toggle('header-form__field--missing', isMissing);
      box.querySelector('.required').hidden = !isNeeded;
    }
    const names = missing.join(', ');
    setText(
      this.parts.missing,
      names
        ? `${t('header.missing', { n: missing.length })}. ${t('header.missing_which', { names })}`
        : t('header.complete'),
    );
  }
}

customElements.define('header-form', HeaderForm);
