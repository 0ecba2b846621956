/** The measures of a defect in its form: what was measured, and the button that measures. */

import { KINDS, usualKind } from '../../../core/wall/measure.js';
import { html, patchList, render, setText } from '../../../core/page/html.js';
import { withKey } from '../../../core/page/keys.js';
import { Component } from '../../../core/page/store.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { figureText, kindText } from './figures.js';

export class MeasureBox extends Component {
  #item = null;
  /** The kind that a person chose for this defect; null: the usual one of its code. */
  #kind = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'measure/measure-box'>} */
    this.parts = render(
      this,
      html`<div class="flow at-bottom">
          <label class="field grow"><span class="label">${t('measure.what')}</span>
            <select class="input" data-part="kind">${Object.keys(KINDS).map(
              (kind) => html`<option
              value="${kind}">${kindText(kind)}</option>`,
            )}</select></label>
          <button type="button" class="button" data-part="start" aria-pressed="false"
            title="${withKey(t('measure.start_help'), 'Shift + M')}">${icon('ruler')}${t('measure.start')}</button>
        </div>
        <div class="measure__now stack pad-row" data-part="now" hidden>
          <p class="help" data-part="hint"></p>
          <p class="strong number" role="status" data-part="figure"></p>
          <div class="flow at-bottom">
            <button type="button" class="button button--small button--primary" data-part="finish">${icon('check')}${t('measure.finish')}</button>
            <button type="button" class="button button--small" data-part="back">${icon('undo')}${t('measure.back')}</button>
            <button type="button" class="button button--small button--quiet" data-part="cancel">${t('page.cancel')}</button>
          </div>
        </div>
        <ul class="stack unless-empty number" aria-label="${t('measure.list')}" data-part="list"></ul>`,
    );
    const { parts, desk } = this;
    const { measuring } = desk;
    // The form's own handler stores fields; this choice is none.
    this.listen(parts.kind, 'change', (event) => {
      event.stopPropagation();
      this.#kind = parts.kind.value;
      if (measuring.value) this.start();
    });
    this.listen(parts.start, 'click', () => (measuring.value ? measuring.cancel() : this.start()));
    this.listen(parts.finish, 'click', () => measuring.finish());
    this.listen(parts.back, 'click', () => measuring.back());
    this.listen(parts.cancel, 'click', () => measuring.cancel());
    this.listen(measuring, 'change', () => this.#showRunning());
    this.signal.addEventListener('abort', () => measuring.cancel());
    parts.kind.querySelector('[value=depth]').disabled = desk.wall?.radius === null; // a floor has no diameter
    this.#showRunning();
  }

  /** Shows an observation. */
  set(item) {
    this.#item = item;
    const { parts, desk } = this;
    this.hidden = !desk.wall;
    const rules = desk.catalogue.row(item.code, item.char1, item.char2);
    if (!desk.measuring.value) parts.kind.value = this.#kind ?? usualKind(item, rules);
    const rows = (item.measures ?? []).map((measure, i) => ({
      measure,
      i,
      figure: item.measured?.[i] ?? desk.measuring.sizeOf(measure),
    }));
    patchList(
      parts.list,
      rows,
      ({ i, measure }) => `${i} ${measure.kind}`,
      () => this.#createRow(),
      updateRow,
    );
  }

  start() {
    this.desk.measuring.start(this.#item.id, this.parts.kind.value);
  }

  #createRow() {
    const row = Object.assign(document.createElement('li'), { at: 0, className: 'row apart' });
    row.parts = render(
      row,
      html`<span data-part="text"></span>
      <button type="button" class="button button--quiet button--small button--icon" data-part="remove">${icon('trash')}</button>`,
    );
    row.parts.remove.addEventListener('click', () => {
      const measures = this.#item.measures.toSpliced(row.at, 1);
      this.desk.observations.edit(this.#item.id, { measures: measures.length ? measures : null });
    });
    return row;
  }

  #showRunning() {
    const { parts, desk } = this;
    const { value } = desk.measuring;
    parts.start.setAttribute('aria-pressed', String(value !== null));
    const isNew = parts.now.hidden && value !== null;
    parts.now.hidden = value === null;
    if (!value) return;
    if (isNew) this.scrollIntoView({ block: 'nearest' });
    const { kind, points, figure } = value;
    const { least, most } = KINDS[kind];
    parts.kind.value = kind;
    setText(parts.hint, wordFor('measure.hint', kind));
    setText(
      parts.figure,
      t('measure.so_far', { n: points.length, size: figureText(figure ?? desk.measuring.sizeOf(value)) }),
    );
    parts.finish.hidden = most === least;
    parts.finish.disabled = points.length < least;
    parts.back.disabled = points.length === 0;
  }
}

function updateRow(row, { measure, i, figure }) {
  row.at = i;
  const text = `${kindText(measure.kind)} ${figureText(figure)}`;
  setText(row.parts.text, text);
  row.parts.remove.setAttribute('aria-label', t('measure.remove', { what: text }));
  row.parts.remove.title = t('measure.remove', { what: text });
}

customElements.define('measure-box', MeasureBox);
