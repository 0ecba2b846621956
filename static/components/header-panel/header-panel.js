/**
 * The header of the inspection: each field is sent when it is left, and again until the server has it.
 * Typed text is kept in this browser until then, so that a reload loses nothing.
 */

import { ApiError, pause } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { hasFilm } from '../../core/inspection.js';
import { may } from '../../core/rights.js';
import { Component } from '../../core/store.js';
import { errorText, t } from '../../core/words.js';
import '../header-form/header-form.js';
import { icon } from '../icon/icon.js';
import { openRig } from '../run-again/run-again.js';

const PAUSE_S = 3;

class HeaderPanel extends Component {
  /** Values by name that have not reached the server yet. */
  #waiting = new Map();
  /** Values by name that the server refused. */
  #refused = new Map();
  #isSending = false;
  /** @type {Unsent} */
  #unsent;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.#unsent = new Unsent(this.desk.inspection.id);
    this.parts = render(
      this,
      html`<p class="header-panel__rig"><button type="button" class="button button--small" data-part="rig" data-needs="operator"
          hidden>${icon('settings')}${t('again.rig_open')}</button></p>
        <p class="header-panel__state number" role="status" data-part="state"></p>
        <fieldset class="locked" ${!may('operator') && 'disabled'}><header-form data-part="form"></header-form></fieldset>`,
    );
    const { form, rig } = this.parts;
    this.listen(rig, 'click', () => this.#editRig());
    form.value = this.desk.inspection.value.header;
    this.listen(form, 'typing', ({ detail: { name, value } }) => {
      const isAsBefore = (this.desk.inspection.value.header[name] ?? null) === value;
      this.#unsent.put(name, value);
      if (isAsBefore) this.#unsent.drop(name, value);
      this.parts.state.textContent = isAsBefore ? t('header.saved') : t('header.saving');
    });
    this.listen(form, 'field', ({ detail: { name, value } }) => {
      this.#refused.delete(name);
      this.#waiting.set(name, value);
      this.#unsent.put(name, value);
      this.#send();
    });
    this.listen(this.desk.inspection, 'change', () => this.#refresh());
    this.#showRig();
    if (may('operator')) this.#goOn();
  }

  /** Sends what an earlier page could not. */
  #goOn() {
    for (const [name, value] of this.#unsent.all) this.#waiting.set(name, value);
    this.#refresh();
    if (this.#waiting.size) this.#send();
  }

  /** During a run, and without a film, there is nothing to track again. */
  #showRig() {
    const { inspection } = this.desk;
    this.parts.rig.hidden = inspection.isUnfinished || !hasFilm(inspection.value);
  }

  async #editRig() {
    if (await openRig(this.desk.inspection)) location.reload(); // the picture and the 3D view change too
  }

  /** Shows the server's values, overlaid with unsent text. */
  #refresh() {
    this.#showRig();
    const typed = [...this.#refused, ...this.#waiting];
    this.parts.form.value = { ...this.desk.inspection.value.header, ...Object.fromEntries(typed) };
  }

  /** Sends one change at a time: the server receives the whole header. */
  async #send() {
    if (this.#isSending) return;
    this.#isSending = true;
    while (this.#waiting.size && !this.signal.aborted) {
      const [[name, value]] = this.#waiting;
      this.parts.state.textContent = t('header.saving');
      try {
        const { header } = this.desk.inspection.value;
        await this.desk.inspection.change({ header: withField(header, name, value) });
        this.#settle(name, value);
      } catch (error) {
        if (!(error instanceof ApiError)) throw error;
        this.parts.state.textContent = errorText(error);
        if (error.isTemporary) {
          await pause(PAUSE_S, this.signal);
        } else {
          this.#refused.set(name, value);
          this.parts.form.fault(name, errorText(error));
          this.#settle(name, value);
        }
      }
    }
    this.#isSending = false;
    if (!this.signal.aborted && this.#refused.size === 0) this.parts.state.textContent = t('header.saved');
  }

  /** Marks a value as sent, unless the person has entered another one meanwhile. */
  #settle(name, value) {
    if (this.#waiting.get(name) !== value) return;
    this.#waiting.delete(name);
    this.#unsent.drop(name, value);
  }
}

/** Values by name that were typed for one inspection and have not been sent, stored in this browser. */
class Unsent {
  #key;

  constructor(inspection) {
    this.#key = `chainage.header.${inspection}`;
  }

  get all() {
    return new Map(JSON.parse(localStorage.getItem(this.#key) ?? '[]'));
  }

  put(name, value) {
    this.#keep(this.all.set(name, value));
  }

  /** Drops a value, unless more has been typed meanwhile. */
  drop(name, value) {
    const all = this.all;
    if (all.get(name) !== value) return;
    all.delete(name);
    this.#keep(all);
  }

  #keep(all) {
    if (all.size) localStorage.setItem(this.#key, JSON.stringify([...all]));
    else localStorage.removeItem(this.#key);
  }
}

/** Returns the header with another value, or without the field. */
const withField = (header, name, value) =>
  Object.fromEntries(Object.entries({ ...header, [name]: value }).filter(([, kept]) => kept !== null));

customElements.define('header-panel', HeaderPanel);
