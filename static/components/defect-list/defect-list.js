/** The tagged defects along the culvert; the form of the selected one takes the list's place. */

import { html, patchList, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { clockHour, metresNumber, plusMinus, timecode } from '../../core/units.js';
import { icon } from '../icon/icon.js';
import { severityMark } from '../severity-mark/severity-mark.js';
import '../defect-form/defect-form.js';

const SAVE_WORDS = { saved: '', waiting: 'Waiting to be saved', refused: 'Not saved' };

class DefectList extends Component {
  #focusBefore = document.body;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', 'Defects');
    this.parts = render(
      this,
      html`<div class="defects" data-part="overview">
          <div class="defects__head"><h2>Defects <span class="dim number" data-part="count"></span></h2></div>
          <div class="defects__empty" data-part="empty">
            <p>Nothing tagged yet.</p>
            <p class="dim">Press <kbd>T</kbd> to tag the middle of the picture, a digit to tag it with a code, or click
              the spot on the picture. Details can wait.</p>
          </div>
          <ol class="defects__rows" data-part="rows"></ol>
        </div>
        <div data-part="details" class="defects__details" hidden></div>`,
    );
    const { desk } = this;
    this.listen(desk.observations, 'change', () => this.#update());
    this.listen(desk.selection, 'change', () => this.#select());
    this.listen(desk.editing, 'change', () => this.#edit());
    this.#update();
  }

  #update() {
    const { parts, desk } = this;
    const items = desk.observations.value;
    parts.count.textContent = items.length ? String(items.length) : '';
    parts.empty.hidden = items.length > 0;
    patchList(
      parts.rows,
      items,
      ({ id }) => id,
      (item) => this.#createRow(item),
      (row, item) => this.#updateRow(row, item),
    );
    this.#select();
  }

  #createRow({ id }) {
    const row = document.createElement('li');
    row.className = 'defect';
    row.parts = render(
      row,
      html`<button class="defect__main" data-part="main">
          <span data-part="mark"></span>
          <span class="defect__what"><b data-part="code"></b> <span data-part="label"></span></span>
          <b class="defect__where number" data-part="distance"></b>
          <span class="defect__more dim number"><span class="defect__save" data-part="save"></span>
            <span data-part="more"></span></span>
          <span class="defect__interval dim number" data-part="interval"></span>
          <span class="defect__photo"><img data-part="photo" alt="" width="72" height="54" loading="lazy" hidden /></span>
        </button>
        <span class="defect__buttons">
          <button class="button button--quiet button--small button--icon" data-part="edit" title="Edit (E)">${icon('edit')}</button>
          <button class="button button--quiet button--small button--icon" data-part="remove" title="Delete (Del)">${icon('trash')}</button>
        </span>`,
    );
    const page = this.closest('inspection-page');
    // A click leaves the focus, and with it the space bar, where it was.
    row.addEventListener('mousedown', (event) => event.preventDefault());
    row.parts.main.addEventListener('click', () => this.desk.goTo(id));
    row.parts.edit.addEventListener('click', () => {
      this.desk.goTo(id);
      this.desk.editing.set(true);
    });
    row.parts.remove.addEventListener('click', () => page.remove(id));
    return row;
  }

  #updateRow({ parts }, item) {
    const name = `${item.code || 'tag'} at ${metresNumber(item.distance_m)} m`;
    render(parts.mark, severityMark(item.severity));
    parts.code.textContent = [item.code, item.char1, item.char2].filter(Boolean).join(' ');
    parts.label.textContent = this.desk.catalogue.label(item.code, item.char1, item.char2);
    parts.distance.textContent = `${metresNumber(item.distance_m)} m`;
    parts.interval.textContent = plusMinus(item.distance_u95_m);
    parts.more.textContent = [clockText(item), timeText(item), item.remark].filter(Boolean).join(' · ');
    parts.save.textContent = item.save === 'refused' ? `Not saved: ${item.refusal}` : SAVE_WORDS[item.save];
    parts.save.classList.toggle('defect__save--refused', item.save === 'refused');
    parts.edit.setAttribute('aria-label', `Edit ${name}`);
    parts.remove.setAttribute('aria-label', `Delete ${name}`);
    if (item.photo && parts.photo.getAttribute('src') !== item.photo) parts.photo.src = item.photo;
    parts.photo.hidden = !item.photo;
  }

  #select() {
    const { value: selected } = this.desk.selection;
    for (const row of this.parts.rows.children) {
      const isSelected = row.dataset.key === selected;
      if (isSelected === (row.parts.main.getAttribute('aria-current') === 'true')) continue;
      row.parts.main.setAttribute('aria-current', String(isSelected));
      if (isSelected) this.#scrollTo(row);
    }
    if (this.desk.editing.value && !selected) this.desk.editing.set(false);
    else if (this.desk.editing.value) this.#edit();
  }

  /** Scrolls the list alone: on a phone the page must stay at the picture. */
  #scrollTo({ offsetTop: top, offsetHeight: height }) {
    const { rows } = this.parts;
    const lowest = top + height - rows.clientHeight;
    rows.scrollTop = Math.min(Math.max(rows.scrollTop, lowest), top);
  }

  #edit() {
    const { parts, desk } = this;
    const { value: id } = desk.selection;
    const isOpen = desk.editing.value && id !== null;
    const form = parts.details.firstElementChild;
    if (isOpen && !form) this.#focusBefore = document.activeElement;
    parts.overview.hidden = isOpen;
    parts.details.hidden = !isOpen;
    if (!isOpen) {
      if (form) this.#closeForm(form);
      return;
    }
    if (form?.observationId === id) return;
    const next = document.createElement('defect-form');
    next.observationId = id;
    parts.details.replaceChildren(next);
  }

  /** The keys go back to where they were, if that is still there. */
  #closeForm(form) {
    form.remove();
    const wasOnPage = this.#focusBefore === document.body || !this.#focusBefore.isConnected;
    const next = wasOnPage ? document.querySelector('#main') : this.#focusBefore;
    next.focus({ preventScroll: true });
  }
}

const clockText = ({ clock_from: from, clock_to: to, clock }) => {
  if (from && to) return `${from} to ${to} o’clock`;
  if (from ?? clock) return clockHour(from ?? clock);
  return '';
};

const timeText = ({ time_s: time, frame }) =>
  time === undefined || time === null ? `frame ${frame}` : timecode(time);

customElements.define('defect-list', DefectList);
