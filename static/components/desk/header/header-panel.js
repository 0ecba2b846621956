/**
 * The header of the inspection: each field is sent when it is left, and again until the server has it.
 * Typed text is kept in this browser until then, so that a reload loses nothing.
 */

import { ApiError, pause } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { ofPerson, recall, remember } from '../../../core/page/remembered.js';
import { mayEdit } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { assetPath } from '../../assets/assets-page/asset-table.js';
import './header-form.js';
import { icon } from '../../shared/icon/icon.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';
import { askMove } from '../dialogs/move-pack.js';
import { openTurn } from '../dialogs/run-again.js';

const PAUSE_S = 3;
/** Turns of the camera about its optical axis, in degrees. */
const TURNS = [-90, 90, 180];

/**
 * @typedef {object} Entry what was entered into a field
 * @property {string|number|boolean|null} value
 * @property {unknown[]} own values that the person has seen or stated in the field; any other stored value is somebody else's
 */

export class HeaderPanel extends Component {
  /** @type {Map<string, Entry>} entries by field name that are not on the server yet */
  #waiting = new Map();
  /** @type {Map<string, Entry>} entries that the server refuses */
  #refused = new Map();
  /** @type {Map<string, Entry & {theirs: unknown}>} entries of fields that somebody else has changed meanwhile */
  #overtaken = new Map();
  /** Counts the conflicts that were found, so that each gets a new id. */
  #found = 0;
  #isSending = false;
  /** @type {Unsent} */
  #unsent;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.#unsent = new Unsent(this.desk.inspection.id);
    /** @type {Parts<'header/header-panel'>} */
    this.parts = render(
      this,
      html`<div class="row wrap apart gap-1 below-3" data-part="rigs" data-needs="operator" hidden>
          <button type="button" class="button button--small" data-part="rig">${icon('settings')}${t('again.rig_open')}</button>
          <span class="row wrap gap-1 small" role="group" aria-label="${t('again.turn')}"><span class="dim">${t('again.turn')}</span>
            ${TURNS.map(
              (degrees) => html`<button type="button" class="button button--small number" data-turn="${degrees}"
              title="${t('again.turn_help')}">${degrees < 0 ? `−${-degrees}` : degrees}°</button>`,
            )}</span></div>
        <p class="row wrap apart gap-1 below-3" data-part="ofAsset" hidden><a class="button button--small" data-part="asset">${icon('layers')}${t('assets.history_of')}</a></p>
        <p class="header-panel__state small dim number" role="status" data-part="state"></p>
        <fieldset class="locked" ${!mayEdit() && 'disabled'}><header-form data-part="form"></header-form></fieldset>`,
    );
    const { form, rig } = this.parts;
    this.listen(rig, 'click', () => this.closest('inspection-page').trackAgain());
    for (const button of this.querySelectorAll('[data-turn]')) {
      this.listen(button, 'click', () => this.#turn(Number(button.dataset.turn)));
    }
    form.value = this.desk.inspection.value.header;
    this.listen(form, 'typing', ({ detail: { name, value, before } }) => {
      const isAsBefore = (this.desk.inspection.value.header[name] ?? null) === value;
      this.#unsent.put(name, { value, own: this.#ownOf(name, before) });
      if (isAsBefore) this.#unsent.drop(name, value);
      this.parts.state.textContent = isAsBefore ? t('header.saved') : t('header.saving');
    });
    this.listen(form, 'field', ({ detail }) => this.#left(detail));
    this.listen(this.desk.inspection, 'change', () => this.#refresh());
    this.listen(this.desk.counter, 'change', () => this.#propose());
    this.#showButtons();
    this.#propose();
    if (mayEdit()) this.#goOn();
  }

  /** Offers what is burnt into the film. */
  #propose() {
    this.parts.form.propose({ date: this.desk.counter.value?.film_date });
  }

  /** Sends the entries that an earlier page could not send. */
  #goOn() {
    this.#waiting = this.#unsent.all;
    this.#refresh();
    if (this.#waiting.size) this.#send();
  }

  /** Returns the person's own values of a field, including one that may just be reaching the server. */
  #ownOf(name, before) {
    const last = this.#waiting.get(name);
    if (last) return [...last.own, last.value];
    const kept = this.#overtaken.get(name) ?? this.#refused.get(name) ?? this.#unsent.all.get(name);
    return kept?.own ?? [before];
  }

  async #left({ name, value, before }) {
    if (name === 'code_pack' && !(await this.#mayMove(value))) {
      this.parts.form.value = { ...this.parts.form.all, code_pack: before };
      return;
    }
    const own = this.#ownOf(name, before);
    this.#refused.delete(name);
    this.#overtaken.delete(name);
    this.#enter(name, { value, own });
    this.#send();
  }

  /** Asks whether the inspection shall be coded with another pack. */
  async #mayMove(pack) {
    const select = this.querySelector('[data-field="code_pack"]');
    try {
      return await askMove(this.desk, pack, select.selectedOptions[0].text);
    } catch (error) {
      toastError(error);
      return false;
    }
  }

  #enter(name, entry) {
    this.#waiting.set(name, entry);
    this.#unsent.put(name, entry);
  }

  /** Hides what tracks again during a run, and without a film; and the way to other inspections of no asset. */
  #showButtons() {
    const { inspection } = this.desk;
    const { asset } = inspection.value;
    this.parts.rigs.hidden = inspection.isUnfinished || !hasFilm(inspection.value);
    this.parts.ofAsset.hidden = asset === null;
    if (asset !== null) this.parts.asset.href = assetPath(asset);
  }

  async #turn(degrees) {
    if (await openTurn(this.desk.inspection, degrees)) location.reload(); // the picture and the 3D view change too
  }

  /** Shows the server's values, overlaid with unsent text. */
  #refresh() {
    this.#showButtons();
    const typed = [...this.#refused, ...this.#overtaken, ...this.#waiting].map(([name, { value }]) => [name, value]);
    this.parts.form.value = { ...this.desk.inspection.value.header, ...Object.fromEntries(typed) };
  }

  /** Sends one change at a time, with all fields that wait: those that were filled together are one step. */
  async #send() {
    if (this.#isSending) return;
    this.#isSending = true;
    try {
      await this.#sendAll();
    } finally {
      this.#isSending = false;
    }
    if (this.signal.aborted) return;
    this.#stateConflict();
    if (this.#refused.size + this.#overtaken.size === 0) this.parts.state.textContent = t('header.saved');
  }

  async #sendAll() {
    await null; // so that what is filled in together goes together
    let isOneByOne = false;
    while (this.#waiting.size && !this.signal.aborted) {
      const sent = new Map(isOneByOne ? [[...this.#waiting][0]] : this.#waiting);
      this.parts.state.textContent = t('header.saving');
      try {
        const theirs = await this.desk.inspection.stateFields(sent);
        for (const [name, entry] of sent) {
          if (theirs.has(name)) this.#keep(name, entry, theirs.get(name));
          else this.#settle(name, entry);
        }
      } catch (error) {
        if (!(error instanceof ApiError)) throw error;
        this.parts.state.textContent = errorText(error);
        if (error.isTemporary) {
          await pause(PAUSE_S, this.signal);
        } else if (sent.size > 1) {
          isOneByOne = true; // to find the one that is refused
        } else {
          const [[name, entry]] = sent;
          this.#refused.set(name, entry);
          this.parts.form.fault(name, errorText(error));
          this.#settle(name, entry);
        }
      }
    }
  }

  /** Marks a value as sent, unless the person has entered another one meanwhile. */
  #settle(name, entry) {
    if (this.#waiting.get(name) !== entry) return;
    this.#waiting.delete(name);
    this.#unsent.drop(name, entry.value);
  }

  /** Keeps an overtaken entry, in this browser too, until a person decides. */
  #keep(name, entry, theirs) {
    if (this.#waiting.get(name) !== entry) return;
    this.#waiting.delete(name);
    this.#overtaken.set(name, { ...entry, theirs });
    this.#found += 1;
    const text = errorText({ code: 'changed_meanwhile' });
    this.parts.state.textContent = text;
    this.parts.form.fault(name, text);
  }

  /** Reports all overtaken fields as one conflict. */
  #stateConflict() {
    const fields = [...this.#overtaken];
    const valuesOf = (which) => Object.fromEntries(fields.map(([name, entry]) => [name, entry[which]]));
    /** @type {import('../../../core/defects/conflicts.js').Conflict} */
    const conflict = {
      id: `header ${this.#found} ${fields.length}`,
      kind: 'header',
      mine: valuesOf('value'),
      theirs: valuesOf('theirs'),
      keepMine: () => this.#decide(fields, true),
      takeTheirs: () => this.#decide(fields, false),
    };
    this.desk.conflicts.state('header', fields.length ? [conflict] : []);
  }

  #decide(fields, isMine) {
    for (const [name, { value, theirs }] of fields) {
      this.#overtaken.delete(name);
      this.parts.form.fault(name, null);
      if (isMine) this.#enter(name, { value, own: [theirs] });
      else this.#unsent.drop(name, value);
    }
    this.#refresh();
    for (const [name] of fields) this.parts.form.restore(name);
    return this.#send();
  }
}

/** Entries by name that the person typed for one inspection and are not on the server yet, in this browser. */
class Unsent {
  #key;

  constructor(inspection) {
    this.#key = ofPerson(`chainage.unsent-header.${inspection}`);
  }

  /** @returns {Map<string, Entry>} */
  get all() {
    return new Map(recall(this.#key, []));
  }

  put(name, entry) {
    this.#keep(this.all.set(name, entry));
  }

  /** Drops a value, unless more has been typed meanwhile. */
  drop(name, value) {
    const all = this.all;
    if (all.get(name)?.value !== value) return;
    all.delete(name);
    this.#keep(all);
  }

  #keep(all) {
    remember(this.#key, all.size ? [...all] : null);
  }
}

customElements.define('header-panel', HeaderPanel);
