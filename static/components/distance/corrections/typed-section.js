/** Distances that a person types at frames, where neither the camera nor a counter says them. */

import { html, patchList, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { isAny, metresField, placeText, readMetres } from './fields.js';

export class TypedSection extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    /** @type {Parts<'corrections/typed-section'>} */
    this.parts = render(
      this,
      html`<h3>${t('typed.title')}</h3>
        <p class="help">${t('typed.help')}</p>
        <ul class="stack gap-1 unless-empty" data-part="rows"></ul>
        <form class="row wrap gap-3 at-bottom" data-part="form" novalidate>
          ${metresField({ part: 'distance', id: 'typed-distance', label: t('typed.here') })}
          <button class="button button--small" data-part="set">${icon('check')}${t('typed.set')}</button>
        </form>`,
    );
    const { desk, parts } = this;
    this.listen(parts.form, 'submit', (event) => {
      event.preventDefault();
      this.#set();
    });
    this.listen([desk.corrections, desk.track], 'change', () => this.#show());
    this.#show();
  }

  get #typed() {
    return this.desk.corrections.value?.stated.typed ?? [];
  }

  /** States the distance of the shown frame; another one of the same frame is replaced. */
  async #set() {
    const { parts, desk } = this;
    const metres = readMetres(parts, 'distance', isAny, t('header.fault_number'));
    if (metres === undefined || metres === null) {
      parts.distance.focus();
      return;
    }
    const { frame, row } = desk.playhead.value;
    if (!row) {
      desk.fault(t('desk.not_tracked'));
      return;
    }
    parts.distance.value = '';
    const others = this.#typed.filter((typed) => typed.frame !== frame);
    const typed = [...others, { frame, distance_m: metres }].sort((a, b) => a.frame - b.frame);
    await this.#state(typed, t('typed.was_set', { frame, distance: chainage(metres) }));
  }

  #remove(frame) {
    return this.#state(
      this.#typed.filter((typed) => typed.frame !== frame),
      t('typed.was_removed', { frame }),
    );
  }

  /** Applies at once, as undo takes it back. */
  #state(typed, text) {
    const { value, isEdited } = this.desk.corrections;
    if (isEdited) this.desk.corrections.edit({ typed });
    else return this.page.correct({ ...value.stated, typed }, null, { text });
  }

  #show() {
    patchList(
      this.parts.rows,
      this.#typed,
      ({ frame }) => frame,
      (typed) => this.#createRow(typed),
      ({ parts }, { frame, distance_m: m }) => (parts.go.textContent = placeText(frame, chainage(m))),
    );
  }

  #createRow({ frame }) {
    const row = document.createElement('li');
    row.className = 'row apart';
    row.parts = render(
      row,
      html`<button type="button" class="link number" data-part="go"></button>
        <button type="button" class="button button--quiet button--small button--icon" data-part="remove"
          aria-label="${t('typed.remove', { frame })}" title="${t('typed.remove', { frame })}">${icon('trash')}</button>`,
    );
    this.listen(row.parts.go, 'click', () => this.desk.seek(frame));
    this.listen(row.parts.remove, 'click', () => this.#remove(frame));
    return row;
  }

  /** Lets the person type, from a notice elsewhere on the desk. */
  begin() {
    this.scrollIntoView({ block: 'nearest' });
    this.parts.distance.focus();
  }
}

customElements.define('typed-section', TypedSection);
