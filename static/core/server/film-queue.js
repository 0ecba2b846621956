/**
 * Films that are uploaded one after the other, and become inspections, also one after the other, when somebody
 * has asked for it.
 *
 * A film that fails keeps its reason, and the next one follows.
 */

import { ApiError } from './api.js';
import { Upload } from './upload.js';
import { errorText } from '../page/words.js';

/**
 * A film of the queue.
 *
 * States: those of its upload; DONE => MAKING (its inspection) => MADE | REFUSED.
 */
class Film {
  /** Id of its inspection; null until it is made. @type {string|null} */
  inspection = null;
  /** A sentence that says why no inspection was made of it. @type {string|null} */
  refused = null;
  isBeingMade = false;
  /** Whether it is left as it is until somebody asks for another try. */
  isLeft = false;

  /** @param {import('./film-files.js').Found} found */
  constructor({ file, path }) {
    this.file = file;
    this.path = path;
    this.upload = new Upload(file, path);
  }

  get state() {
    if (this.inspection) return 'MADE';
    if (this.isBeingMade) return 'MAKING';
    return this.refused ? 'REFUSED' : this.upload.state;
  }

  get hasFailed() {
    return this.state === 'FAILED' || this.state === 'REFUSED';
  }
}

/**
 * Events: `change` whenever anything has changed; `end` when there is nothing left to do of what `make` was asked.
 */
export class FilmQueue extends EventTarget {
  /** @type {Film[]} */
  films = [];
  isPaused = false;

  /**
   * Makes an inspection of an uploaded film and returns its id; null until somebody asks for it.
   * @type {((film: Film) => Promise<string>)|null}
   */
  #make = null;
  #isSending = false;
  #isMakingOne = false;

  get bytes() {
    return sum(this.films.map(({ upload }) => upload.size));
  }

  get bytesSent() {
    return sum(this.films.map(({ upload }) => (upload.state === 'DONE' ? upload.size : upload.offset)));
  }

  /** The film that is being sent; undefined if there is none. */
  get sending() {
    return this.films.find(({ state }) => state === 'SENDING' || state === 'WAITING');
  }

  /** Whether inspections are made of films as they arrive. */
  get isMaking() {
    return this.#make !== null;
  }

  /**
   * Adds films that are not in the queue, and begins to send them.
   * @param {import('./film-files.js').Found[]} found
   */
  add(found) {
    const present = new Set(this.films.map(({ path, file }) => `${path}:${file.size}`));
    for (const one of found) {
      if (present.has(`${one.path}:${one.file.size}`)) continue;
      const film = new Film(one);
      film.upload.addEventListener('change', () => this.#changed());
      this.films.push(film);
    }
    this.#work();
  }

  /** Takes a film out, and deletes what has arrived of it. @param {Film} film */
  async remove(film) {
    this.films = this.films.filter((other) => other !== film);
    this.#changed();
    await film.upload.cancel();
  }

  /** Takes out all films of which no inspection was made. */
  async clear() {
    this.#make = null;
    await Promise.all(this.films.filter(({ state }) => !isSettled(state)).map((film) => this.remove(film)));
  }

  pause() {
    this.isPaused = true;
    this.sending?.upload.pause();
    this.#changed();
  }

  /** Sends on, and sends films again that have failed. */
  goOn() {
    this.isPaused = false;
    for (const film of this.films) film.isLeft = false;
    this.#work();
  }

  /**
   * Makes an inspection of each film that has arrived or will.
   * @param {(film: Film) => Promise<string>} make
   */
  makeWith(make) {
    this.#make = make;
    for (const film of this.films) film.refused = null;
    this.goOn();
  }

  /** Makes no further inspections. */
  stopMaking() {
    this.#make = null;
    this.#changed();
  }

  /** Sends and makes at the same time: a film may have to wait for room that an inspection gives back. */
  #work() {
    this.#changed();
    this.#sendAll();
    this.#makeAll();
  }

  async #sendAll() {
    if (this.#isSending) return;
    this.#isSending = true;
    for (let film; (film = this.#nextToSend); ) {
      await film.upload.start();
      film.isLeft = film.hasFailed;
      this.#makeAll();
    }
    this.#isSending = false;
    this.#endIfDone();
  }

  async #makeAll() {
    if (this.#isMakingOne) return;
    this.#isMakingOne = true;
    for (let film; (film = this.#nextToMake); ) {
      await this.#makeInspection(film);
      film.isLeft = film.hasFailed;
    }
    this.#isMakingOne = false;
    this.#endIfDone();
  }

  get #open() {
    return this.films.filter((film) => !film.inspection && !film.isLeft);
  }

  get #nextToSend() {
    return this.isPaused ? undefined : this.#open.find(({ upload }) => upload.state !== 'DONE');
  }

  get #nextToMake() {
    return this.#make ? this.#open.find(({ upload }) => upload.state === 'DONE') : undefined;
  }

  #endIfDone() {
    const isWorking = this.#isSending || this.#isMakingOne || this.#nextToSend || this.#nextToMake;
    if (this.#make && !this.isPaused && !isWorking) {
      this.#make = null;
      this.dispatchEvent(new Event('end'));
    }
    this.#changed();
  }

  /** @param {Film} film */
  async #makeInspection(film) {
    film.isBeingMade = true;
    this.#changed();
    try {
      film.inspection = await this.#make(film);
      film.upload.forget();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      film.refused = errorText(error);
      if (!error.isTemporary) await film.upload.reject({ code: error.code, reason: film.refused });
    } finally {
      film.isBeingMade = false;
    }
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}

/** @param {Film['state']} state */
const isSettled = (state) => state === 'MADE' || state === 'MAKING';

/** @param {number[]} numbers */
const sum = (numbers) => numbers.reduce((all, number) => all + number, 0);
