/**
 * The choice of films: dropped or picked, one, several or a folder, with the progress of each and of all.
 *
 * `queue` holds and uploads them. Event `films`: other films are chosen.
 */

import { droppedFiles, filesOf, filmsAmong, namesOf } from '../../../core/server/film-files.js';
import { FilmQueue } from '../../../core/server/film-queue.js';
import { html, patchList, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { bytes, duration } from '../../../core/wall/units.js';
import { discardUpload, unfinishedFilms } from '../../../core/server/upload.js';
import { pieces, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const ACCEPTED = 'video/*,.mp4,.mov,.m4v,.mkv,.avi,.mpg,.mpeg,.vob,.ts,.mts,.m2ts,.m2t,.webm';

export class FilmPicker extends Component {
  queue = new FilmQueue();

  mount() {
    /** @type {Parts<'film-picker/film-picker'>} */
    this.parts = render(
      this,
      html`<div class="drop" data-part="drop">
          <div class="drop__ask stack" data-part="ask">
            ${icon('film')}
            <p>${t('films.drop')}</p>
            <div class="drop__buttons flow">
              <button type="button" class="button" data-part="pick">${t('films.pick')}</button>
              <button type="button" class="button" data-part="pickFolder">${t('films.pick_folder')}</button>
            </div>
            <p class="help">${t('films.formats')}</p>
          </div>
          <div class="stack" data-part="chosen" hidden>
            <div class="drop__all stack line-below" data-part="all">
              <p><b data-part="count"></b> <span class="dim number" data-part="size"></span></p>
              <progress class="bar" data-part="bar" max="1" aria-label="${t('films.progress')}"></progress>
              <p class="drop__total dim number" role="status" data-part="total"></p>
            </div>
            <ul class="drop__films stack gap-3" data-part="list"></ul>
            <div class="drop__buttons flow">
              <button type="button" class="button button--small" data-part="pause"></button>
              <button type="button" class="button button--small" data-part="more">${t('films.more')}</button>
              <button type="button" class="button button--small" data-part="clear">${t('films.remove_all')}</button>
            </div>
          </div>
          <input type="file" accept="${ACCEPTED}" multiple data-part="input" hidden />
          <input type="file" webkitdirectory data-part="folder" hidden />
        </div>
        <p class="message drop__others" role="status" data-part="others" hidden></p>
        <div class="unless-empty" data-part="unfinished"></div>`,
    );
    const { drop, input, folder, pick, pickFolder, more, pause, clear } = this.parts;
    for (const button of [pick, more]) this.listen(button, 'click', () => input.click());
    this.listen(pickFolder, 'click', () => folder.click());
    for (const chosen of [input, folder]) {
      this.listen(chosen, 'change', () => {
        this.#add(filesOf(chosen));
        chosen.value = ''; // so that the same files can be chosen again
      });
    }
    this.listen(drop, 'dragover', (event) => this.#drag(event, true));
    this.listen(drop, 'dragleave', (event) => this.#drag(event, false));
    this.listen(drop, 'drop', (event) => this.#drop(event));
    this.listen(pause, 'click', () => (this.#isStopped ? this.queue.goOn() : this.queue.pause()));
    this.listen(clear, 'click', () => this.#clear());
    this.listen(this.queue, 'change', () => this.repaint());
    this.#showUnfinished();
    this.paint();
  }

  /** The names of the inspections to be, of the films in their order. */
  get names() {
    return namesOf(this.queue.films.map(({ path }) => path));
  }

  focus() {
    const { ask, pick, more } = this.parts;
    (ask.hidden ? more : pick).focus();
  }

  paint() {
    const { queue, parts } = this;
    const { films } = queue;
    const hadFocus = this.contains(document.activeElement);
    parts.ask.hidden = films.length > 0;
    parts.chosen.hidden = films.length === 0;
    parts.all.hidden = films.length < 2;
    patchList(
      parts.list,
      films,
      ({ path, file }) => `${path}:${file.size}`,
      (film) => this.#row(film),
      (row, film) => this.#showFilm(row, film),
    );
    this.#showAll();
    const isIdle = !queue.sending && !films.some(({ state }) => state === 'PAUSED' || state === 'FAILED');
    parts.pause.hidden = isIdle;
    parts.pause.textContent = this.#isStopped ? t('films.go_on') : t('films.pause');
    parts.clear.hidden = films.filter(({ inspection }) => !inspection).length < 2;
    // Not into nothing, when the focused button has left the page.
    const { activeElement } = document;
    if (hadFocus && !(this.contains(activeElement) && activeElement.checkVisibility())) this.focus();
  }

  get #isStopped() {
    return this.queue.isPaused || !this.queue.sending;
  }

  #drag(event, isOver) {
    event.preventDefault();
    this.parts.drop.classList.toggle('drop--over', isOver);
  }

  async #drop(event) {
    this.#drag(event, false);
    try {
      this.#add(await droppedFiles(event.dataTransfer));
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      this.#say(t('films.folder_unreadable'));
    }
  }

  /** @param {string} sentence about the files that were chosen last; '' for none */
  #say(sentence) {
    this.parts.others.hidden = sentence === '';
    this.parts.others.textContent = sentence;
  }

  #add(found) {
    if (!found.length) return;
    const { films, others } = filmsAmong(found);
    if (!films.length) {
      this.#say(t('films.only_others', { n: others }));
      return;
    }
    this.#say(others ? t('films.others', { n: others }) : '');
    this.queue.add(films);
    this.#chosen();
  }

  async #remove(film) {
    const removed = this.queue.remove(film);
    this.#chosen();
    await removed;
  }

  async #clear() {
    const removed = this.queue.clear();
    this.#chosen();
    await removed;
  }

  #chosen() {
    this.paint();
    this.#showUnfinished();
    this.dispatchEvent(new Event('films'));
  }

  #row(film) {
    const row = document.createElement('li');
    row.className = 'drop__film';
    row.parts = render(
      row,
      html`<p class="drop__name breaks"><b>${film.path}</b> <span class="dim number">${bytes(film.file.size)}</span></p>
        <button type="button" class="button button--small" data-part="remove"
          aria-label="${t('films.remove_one', { name: film.path })}">${t('films.remove')}</button>
        <progress class="bar" data-part="bar" max="1"
          aria-label="${t('films.progress_of', { name: film.path })}"></progress>
        <p class="drop__state whole-row dim number" data-part="state"></p>
        <a class="drop__made" data-part="made" hidden>${t('films.open')}</a>`,
    );
    this.listen(row.parts.remove, 'click', () => this.#remove(film));
    return row;
  }

  #showFilm({ parts }, film) {
    const { upload, state } = film;
    const share = upload.size ? upload.offset / upload.size : 1;
    parts.bar.value = share;
    // Of several films the line for all of them is read out.
    parts.state.role = this.queue.films.length === 1 ? 'status' : null;
    setText(parts.state, this.#sentence(film, Math.floor(100 * share)));
    parts.state.classList.toggle('drop__state--failed', film.hasFailed);
    parts.remove.hidden = state === 'MADE' || state === 'MAKING';
    parts.made.hidden = state !== 'MADE';
    if (film.inspection) parts.made.href = `/inspections/${film.inspection}`;
  }

  #sentence({ state, refused, upload }, percent) {
    const isAlone = this.queue.films.length === 1;
    return {
      IDLE: isAlone ? '' : t('films.waits'),
      SENDING: `${t('films.sending', { percent })}${isAlone ? pace(upload.speed, upload.etaS) : ''}`,
      WAITING: t('films.waiting', { percent, reason: upload.reason ?? '' }),
      PAUSED: t('films.paused', { percent }),
      DONE: t('films.uploaded'),
      FAILED: upload.reason,
      CANCELLED: '',
      MAKING: t('films.making'),
      MADE: t('films.made'),
      REFUSED: refused,
    }[state];
  }

  #showAll() {
    const { films, bytes: size, bytesSent, sending } = this.queue;
    const { count, size: sizeText, bar, total } = this.parts;
    const failed = films.filter(({ hasFailed }) => hasFailed).length;
    const speed = sending?.upload.speed ?? 0;
    const done = films.filter(({ upload }) => upload.state === 'DONE').length;
    const percent = size ? Math.floor((100 * bytesSent) / size) : 100;
    count.textContent = t('films.count', { n: films.length });
    sizeText.textContent = bytes(size);
    bar.value = size ? bytesSent / size : 1;
    setText(
      total,
      `${t('films.total', { done, n: films.length, percent })}${pace(speed, speed ? (size - bytesSent) / speed : null)}${
        failed ? ` · ${t('films.failed', { n: failed })}` : ''
      }`,
    );
  }

  /** After a reload only the person can open the files again, so name them. */
  #showUnfinished() {
    const waiting = this.queue.films.length ? [] : unfinishedFilms();
    const list = render(
      this.parts.unfinished,
      html`${waiting.map(
        (upload, i) => html`<p class="message drop__unfinished">${icon('info')}
        <span>${whatBecameOf(upload)}</span>
        <button type="button" class="button button--small" data-part="discard${i}">${t('films.discard')}</button></p>`,
      )}`,
    );
    waiting.forEach((upload, i) => {
      list[`discard${i}`].addEventListener('click', async () => {
        await discardUpload(upload);
        this.#showUnfinished();
      });
    });
  }
}

const pace = (speed, etaS) =>
  `${speed ? ` · ${bytes(speed)}/s` : ''}${etaS === null ? '' : ` · ${t('films.left', { time: duration(etaS) })}`}`;

/** @param {import('../../../core/server/upload.js').Unfinished} upload */
function whatBecameOf({ name, size, whole, refused }) {
  const named = { name: html`<b>${name}</b>`, size: bytes(size) };
  if (refused) return pieces('films.refused', { ...named, reason: refused });
  return whole ? pieces('films.unused', named) : pieces('films.interrupted', named);
}

customElements.define('film-picker', FilmPicker);
