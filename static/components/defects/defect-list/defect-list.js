/** The tagged defects along the culvert; the form of the selected one replaces the list. */

import { html, patchList, render, renderNew, setText } from '../../../core/page/html.js';
import { isKeyOn, withKey, ownKey } from '../../../core/page/keys.js';
import { isOpen } from '../../../core/defects/review.js';
import { Component } from '../../../core/page/store.js';
import { coveredShare, defectCount, stretchesOf } from '../../../core/defects/stretches.js';
import { chainage, clockRange, timecode } from '../../../core/wall/units.js';
import { pieces, t, wordFor } from '../../../core/page/words.js';
import { mainPhotoOf } from '../attachments/photos.js';
import { icon } from '../../shared/icon/icon.js';
import { linkTo } from '../../desk/actions/links.js';
import { severityMark } from '../../shared/severity-mark/severity-mark.js';
import { FILTERS, lacksOf, matcher } from './filters.js';
import { intervalText, nameOf, roleText } from './names.js';
import './open-stretches.js';
import './proposed-ends.js';
import '../defect-form/defect-form.js';

const ACT_NOW = 5;
/** Photos are loaded this far before their rows become visible. */
const NEAR_PX = 300;

export class DefectList extends Component {
  #focusBefore = document.body;
  /** Scroll position of the page when the form was opened. */
  #scrollBefore = 0;
  /** Whether the newest come first. Null until the person chooses: then they do so only during a live run. */
  #isNewestFirst = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('defects.label'));
    /** @type {Parts<'defect-list/defect-list'>} */
    this.parts = render(
      this,
      html`<open-stretches></open-stretches>
        <div class="defects" data-part="overview">
          <h2 class="visually-hidden">${t('defects.label')}</h2>
          <proposed-ends></proposed-ends>
          <div class="defects__head stack" data-part="head">
            <input class="input" type="search" placeholder="${t('defects.search')}" aria-label="${t('defects.search')}"
              autocomplete="off" spellcheck="false" data-part="search" />
            <select class="input" aria-label="${t('defects.show')}" data-part="filter">
              ${FILTERS.map(({ name, label }) => html`<option value="${name}">${label}</option>`)}</select>
            <button class="button button--icon" data-part="newest" aria-label="${t('defects.newest')}"
              title="${t('defects.newest')}">${icon('newest')}</button>
          </div>
          <p class="defects__tally row apart dim"><span class="defects__count number" data-part="count"></span>
            <button class="button button--small" data-part="complete" data-needs="operator" title="${withKey(t('keys.complete'), 'V')}"></button></p>
          <div class="defects__empty stack pad-4" data-part="empty">
            <p>${t('defects.empty')}</p>
            ${isKeyOn('t') && html`<p class="dim" data-needs="operator">${pieces('defects.empty_help', { key: html`<kbd>${ownKey('T')}</kbd>` })}</p>`}
          </div>
          <ol class="defects__rows pad-1 grow holds" data-part="rows"></ol>
        </div>
        <div data-part="details" class="defects__details" hidden></div>`,
    );
    const { desk, parts } = this;
    this.listen(desk.observations, 'change', () => this.#update());
    this.listen(desk.attachments, 'change', () => this.#changePhotos());
    this.listen(desk.selection, 'change', () => this.#select());
    this.listen(desk.editing, 'change', () => this.#edit());
    this.listen(desk.track, 'change', () => this.#count());
    this.listen(desk.review, 'change', () => [...parts.rows.children].forEach((row) => this.#showReview(row)));
    this.listen(desk.inspection, 'change', () => this.#update());
    this.listen(parts.search, 'input', () => this.#update());
    this.listen(parts.filter, 'change', () => this.#update());
    this.listen(parts.newest, 'click', () => {
      this.#isNewestFirst = !this.#newestFirst;
      this.#update();
    });
    this.listen(parts.complete, 'click', () => desk.askAll());
    this.listen(parts.rows, 'keydown', (event) => this.#key(event));
    this.listen(document, 'scroll', () => this.repaint(), { capture: true, passive: true });
    const resized = new ResizeObserver(() => this.repaint());
    resized.observe(parts.rows);
    this.signal.addEventListener('abort', () => resized.disconnect());
    this.#update();
    this.#edit();
  }

  /**
   * Loads the photos of visible and nearly visible rows. `loading="lazy"` would do the same, but browsers
   * check each of those pictures before every frame of the film.
   */
  paint() {
    const { rows } = this.parts;
    const box = rows.getBoundingClientRect();
    if (box.height === 0) return;
    const [top, bottom] = [Math.max(box.top, 0) - NEAR_PX, Math.min(box.bottom, innerHeight) + NEAR_PX];
    const boxOf = (i) => rows.children[i].getBoundingClientRect();
    const end = rows.children.length;
    let [from, past] = [0, end];
    while (from < past) {
      const middle = (from + past) >> 1;
      if (boxOf(middle).bottom < top) from = middle + 1;
      else past = middle;
    }
    for (let i = from; i < end && boxOf(i).top <= bottom; i += 1) showPhoto(rows.children[i]);
  }

  get #newestFirst() {
    return this.#isNewestFirst ?? this.desk.inspection.isUnfinished;
  }

  /** The items that pass the filter, in the chosen order. */
  get #items() {
    const { search, filter } = this.parts;
    const items = this.desk.observations.value.filter(matcher(search.value, filter.value, this.desk.catalogue));
    /** Without a number it has not reached the server yet. @param {{seq?: number|null}} item */
    const age = ({ seq }) => seq ?? Infinity;
    return this.#newestFirst ? items.toSorted((a, b) => age(b) - age(a) || b.frame - a.frame) : items;
  }

  #update() {
    const { parts, desk } = this;
    const focused = parts.rows.contains(document.activeElement) ? document.activeElement.closest('li') : null;
    const index = [...parts.rows.children].indexOf(focused);
    patchList(
      parts.rows,
      this.#items,
      ({ id }) => id,
      (item) => this.#createRow(item),
      (row, item) => this.#updateRow(row, item),
    );
    const isEmpty = desk.observations.value.length === 0;
    parts.empty.hidden = !isEmpty;
    parts.head.hidden = isEmpty;
    parts.newest.setAttribute('aria-pressed', String(this.#newestFirst));
    this.#count();
    this.#select();
    this.repaint();
    // The focus stays in the list when its row has moved or gone.
    if (focused && !parts.rows.contains(document.activeElement)) {
      const row = focused.isConnected ? focused : parts.rows.children[Math.min(index, parts.rows.children.length - 1)];
      row?.parts.main.focus({ preventScroll: true });
    }
  }

  #count() {
    const { parts, desk } = this;
    const { value: all } = desk.observations;
    const [shown, n] = [this.#items, all].map(defectCount);
    const { low, high } = desk.track.range;
    const stretches = stretchesOf(all, high / 1000);
    const share = coveredShare(stretches, (high - low) / 1000);
    const { length: lacking } = this.desk.incomplete;
    parts.complete.hidden = lacking === 0;
    setText(parts.complete, t('ask.complete', { n: lacking }));
    parts.count.parentElement.hidden = all.length === 0;
    parts.count.textContent = [
      shown === n ? t('defects.count', { n }) : t('defects.count_of', { shown, n }),
      stretches.length > 0 && t('stretch.share', { percent: Math.round(100 * share) }),
    ]
      .filter(Boolean)
      .join(' · ');
  }

  #createRow({ id }) {
    const row = document.createElement('li');
    row.className = 'defect';
    row.parts = render(
      row,
      html`<a class="defect__main stack bare full" href="${linkTo({ defect: id })}" tabindex="-1" draggable="false" data-part="main">
          <span data-part="mark"></span>
          <span class="defect__what one-line"><b data-part="code"></b> <span data-part="label"></span></span>
          <b class="defect__where number" data-part="distance"></b>
          <span class="defect__more one-line small dim number"><span class="defect__save strong weak" data-part="save"></span>
            <span class="defect__review" data-part="review"></span>
            <span class="defect__lacks weak" data-part="lacks"></span>
            <span data-part="more"></span></span>
          <span class="defect__interval dim number" data-part="interval"></span>
          <span class="defect__photo"><img data-part="photo" alt="" width="72" height="54" hidden /></span>
        </a>
        <span class="defect__buttons">
          <button class="button button--quiet button--small button--icon" data-part="edit" title="${t('defects.edit')}">${icon('edit')}</button>
          <button class="button button--quiet button--small button--icon" data-part="remove" data-needs="operator" title="${t('defects.delete')}">${icon('trash')}</button>
        </span>`,
    );
    const page = this.closest('inspection-page');
    // A click leaves the focus, and with it the space bar, where it was.
    row.addEventListener('mousedown', (event) => event.preventDefault());
    row.parts.main.addEventListener('click', (event) => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return; // opens the link in another tab
      event.preventDefault();
      this.desk.goTo(id);
    });
    row.parts.edit.addEventListener('click', () => {
      this.desk.goTo(id);
      this.desk.editing.set(true);
    });
    row.parts.remove.addEventListener('click', () => page.remove(id));
    return row;
  }

  #updateRow(row, item) {
    if (row.item === item) return; // of thousands of rows only one has changed
    row.item = item;
    const { parts } = row;
    const { catalogue } = this.desk;
    const name = nameOf(item);
    row.classList.toggle('defect--act-now', item.severity === ACT_NOW);
    renderNew(parts.mark, severityMark(item.severity));
    parts.code.textContent = [item.code, item.char1, item.char2].filter(Boolean).join(' ');
    parts.label.textContent = catalogue.label(item.code, item.char1, item.char2);
    parts.distance.textContent = chainage(item.distance_m);
    parts.interval.textContent = intervalText(item);
    parts.more.textContent = [roleText(item), clockText(item), timeText(item), item.remark].filter(Boolean).join(' · ');
    parts.save.textContent = saveText(item);
    parts.save.classList.toggle('defect__save--refused', item.save === 'refused');
    parts.lacks.textContent = lacksOf(item, catalogue).join(', ');
    parts.main.title = parts.more.textContent;
    parts.edit.setAttribute('aria-label', t('defects.edit_named', { name }));
    parts.remove.setAttribute('aria-label', t('defects.delete_named', { name }));
    this.#changePhoto(row);
    this.#showReview(row);
  }

  #changePhotos() {
    for (const row of this.parts.rows.children) this.#changePhoto(row);
    this.repaint();
  }

  /** Notes the main photo of a row; it is loaded when the row becomes visible. */
  #changePhoto(row) {
    row.photo = mainPhotoOf(this.desk, row.item);
    row.parts.photo.hidden = !row.photo;
  }

  /** Shows what a reviewer has said about a defect. */
  #showReview({ item, parts }) {
    const { review } = this.desk;
    const asked = review.about(item.id).filter(isOpen).length;
    const text = asked
      ? t('reviewing.questions', { n: asked })
      : review.isAccepted(item) && wordFor('remark', 'accepted');
    setText(parts.review, text || '');
    parts.review.classList.toggle('defect__review--open', asked > 0);
  }

  /** Up and down go from row to row and select; Enter opens the form. */
  #key(event) {
    const row = event.target.closest('li');
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.target !== row.parts.main || event.ctrlKey || event.altKey || event.shiftKey) return;
    if (event.key === 'Enter') {
      this.desk.select(row.dataset.key);
      this.desk.editing.set(true);
    } else if (step) {
      const next = step > 0 ? row.nextElementSibling : row.previousElementSibling;
      if (next) this.desk.goTo(next.dataset.key);
      next?.parts.main.focus({ preventScroll: true });
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  #select() {
    const { value: selected } = this.desk.selection;
    const rows = [...this.parts.rows.children];
    const reachable = rows.find((row) => row.dataset.key === selected) ?? rows[0];
    for (const row of rows) {
      const isSelected = row.dataset.key === selected;
      row.parts.main.tabIndex = row === reachable ? 0 : -1;
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
    if (isOpen && !form) {
      this.#focusBefore = document.activeElement;
      this.#scrollBefore = scrollY;
    }
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
    // Only for a form opened by the person; neither a tag nor a change of selection takes the keys from the film.
    if (!form && !desk.asking.value) next.enter();
  }

  /** Restores focus and scroll position, if the element still exists; of a form that had not the focus neither. */
  #closeForm(form) {
    const hadFocus = form.contains(document.activeElement);
    form.remove();
    if (!hadFocus) return;
    const wasOnPage = this.#focusBefore === document.body || !this.#focusBefore.isConnected;
    const next = wasOnPage ? document.querySelector('#main') : this.#focusBefore;
    next.focus({ preventScroll: true });
    scrollTo({ top: this.#scrollBefore });
  }
}

function showPhoto({ photo, parts: { photo: shown } }) {
  if (photo && shown.getAttribute('src') !== photo) shown.src = photo;
}

function saveText({ save, refusal }) {
  if (save === 'refused') return t('defects.refused', { reason: refusal });
  return save === 'waiting' ? t('defects.waiting') : '';
}

const clockText = ({ clock_from: from, clock_to: to, clock }) => {
  const hour = from ?? clock;
  return hour ? clockRange(hour, (from && to) || null) : '';
};

const timeText = ({ time_s: time, frame }) =>
  time === undefined || time === null ? t('video.frame', { frame }) : timecode(time);

customElements.define('defect-list', DefectList);
