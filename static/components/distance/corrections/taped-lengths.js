/** Taped lengths between two frames. */

import { html, patchList, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { isPositive, metresField, numberField, read, readMetres, write, writeMetres } from './fields.js';
import { bindEnds, endsMarkup, showEnds } from './length-ends.js';

const USUAL_SIGMA_MM = 5;
const FIELDS = ['first_frame', 'last_frame', 'length_m', 'sigma_mm'];

const isComplete = (tape) => FIELDS.every((name) => tape[name] !== null);
/** @returns {import('../../../core/survey/corrections.js').Length} */
const ofTape = (tape) => Object.fromEntries([...FIELDS.map((name) => [name, tape[name]]), ['kind', 'tape']]);

export class TapedLengths extends Component {
  /** The lengths of the draft and incomplete ones, each with a key. */
  #tapes = [];
  #keys = 0;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'corrections/taped-lengths'>} */
    this.parts = render(
      this,
      html`<h3>${t('corrections.tapes')}</h3>
        <p class="help">${t('corrections.tapes_help')}</p>
        <ul class="stack gap-3 unless-empty" data-part="rows"></ul>
        <div class="fix__buttons row wrap"><button class="button button--small" data-part="add">${icon('plus')}${t('corrections.add_tape')}</button></div>`,
    );
    const { desk, parts } = this;
    this.listen(parts.add, 'click', () => this.#add());
    this.listen(desk.corrections.draft, 'change', () => this.#adopt());
    this.listen(desk.track, 'change', () => this.#show());
    this.#adopt();
  }

  /** Follows changes of the draft by others: undone, discarded. */
  #adopt() {
    const stated = this.desk.corrections.draft.value.lengths.filter(({ kind }) => kind === 'tape');
    const ours = this.#tapes.filter(isComplete).map(ofTape);
    if (JSON.stringify(ours) !== JSON.stringify(stated.map(ofTape))) {
      const begun = this.#tapes.filter((tape) => !isComplete(tape));
      this.#tapes = [...stated.map((tape) => ({ ...tape, key: this.#key() })), ...begun];
    }
    this.#show();
  }

  #key() {
    this.#keys += 1;
    return this.#keys;
  }

  #add() {
    const { frame, row } = this.desk.playhead.value;
    const first = row ? frame : null;
    this.#tapes = [
      ...this.#tapes,
      { key: this.#key(), first_frame: first, last_frame: null, length_m: null, sigma_mm: USUAL_SIGMA_MM },
    ];
    this.#show();
  }

  #change(key, changes) {
    this.#tapes = this.#tapes.map((tape) => (tape.key === key ? { ...tape, ...changes } : tape));
    this.#publish();
  }

  #remove(key) {
    this.#tapes = this.#tapes.filter((tape) => tape.key !== key);
    this.#publish();
  }

  #publish() {
    const { corrections } = this.desk;
    const known = corrections.draft.value.lengths.filter(({ kind }) => kind === 'known');
    corrections.edit({ lengths: [...this.#tapes.filter(isComplete).map(ofTape), ...known] });
  }

  #show() {
    patchList(
      this.parts.rows,
      this.#tapes,
      ({ key }) => key,
      (tape) => this.#createRow(tape),
      ({ parts }, tape) => {
        showEnds(parts, this.desk, tape);
        writeMetres(parts.length, tape.length_m);
        write(parts.sigma, tape.sigma_mm);
        parts.missing.textContent = missing(tape);
      },
    );
  }

  #createRow({ key }) {
    const row = document.createElement('li');
    row.className = 'stack pad-3 framed';
    row.parts = render(
      row,
      html`${endsMarkup()}
        <div class="tape__fields stack gap-3 at-bottom">
          ${metresField({ part: 'length', id: `tape-${key}-length`, label: t('corrections.length') })}
          ${numberField({ part: 'sigma', id: `tape-${key}-sigma`, label: t('corrections.sigma'), unit: 'mm' })}
          <button class="button button--quiet button--small button--icon" data-part="remove"
            aria-label="${t('corrections.remove_tape')}" title="${t('corrections.remove_tape')}">${icon('trash')}</button>
        </div>
        <p class="help unless-empty" data-part="missing"></p>`,
    );
    const { parts } = row;
    bindEnds(parts, this.desk, this.signal, (ends) => this.#change(key, ends));
    this.listen(parts.length, 'change', () => {
      const metres = readMetres(parts, 'length', isPositive, t('corrections.fault_positive'));
      if (metres !== undefined) this.#change(key, { length_m: metres });
    });
    this.listen(parts.sigma, 'change', () => {
      const sigma = read(parts, 'sigma', isPositive, t('corrections.fault_positive'));
      if (sigma) this.#change(key, { sigma_mm: sigma });
    });
    this.listen(parts.remove, 'click', () => this.#remove(key));
    return row;
  }
}

/** Returns what a length still needs before it counts. */
function missing({ first_frame, last_frame, length_m }) {
  if (first_frame === null) return t('corrections.needs_first');
  if (last_frame === null) return t('corrections.needs_last');
  return length_m === null ? t('corrections.needs_length') : '';
}

customElements.define('taped-lengths', TapedLengths);
