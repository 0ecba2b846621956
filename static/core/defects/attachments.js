/**
 * What is attached to the observations of one inspection: further photos, drawings on a copy of a photo, voice
 * notes. Every change shows at once, is safe in this browser until the server has it, and can be undone.
 */

import { get, readOr } from '../server/api.js';
import { newId } from '../page/new-id.js';
import { Store } from '../page/store.js';
import { errorText } from '../page/words.js';

/** Pause before the list is read again, for a missing picture or after a failure. */
const LOAD_PAUSE_MS = 1500;
/** The attachments of most observations. @type {readonly Attachment[]} */
const NONE = Object.freeze([]);

/**
 * @typedef {import('./observations.js').Observation} Observation
 * @typedef {Api['Stroke']} Stroke
 *
 * @typedef {Pick<Api['AttachmentOut'], 'id'|'observation_id'|'kind'|'rank'|'file'> & {strokes?: Stroke[]} &
 *     Partial<Omit<Api['AttachmentOut'], 'strokes'>>} Shown an attachment as far as the page knows it
 *
 * @typedef {object} Saving
 * @property {'saved'|'waiting'|'refused'} save
 * @property {string} [refusal] the reason of a refusal
 * @property {string} [operation] id of what was refused
 * @property {Blob} [sound] of a voice note that the server does not have
 *
 * @typedef {Shown & Saving} Attachment
 */

/** @extends {Store<Attachment[]>} */
export class Attachments extends Store {
  #inspection;
  #outbox;
  #history;
  #signal;
  #stored = /** @type {Map<string, Shown>} */ (new Map());
  /** @type {Map<string, Attachment[]>} */
  #byObservation = new Map();
  #version = 0;
  #timer = 0;

  /**
   * @param {string} inspection
   * @param {import('../server/attachment-outbox.js').AttachmentOutbox} outbox
   * @param {import('./history.js').History} history
   * @param {AbortSignal} signal
   */
  constructor(inspection, outbox, history, signal) {
    super([]);
    this.#inspection = inspection;
    this.#outbox = outbox;
    this.#history = history;
    this.#signal = signal;
    outbox.addEventListener('answered', ({ detail }) => this.#answered(detail), { signal });
    outbox.addEventListener('change', () => this.#publish(), { signal });
    outbox.addEventListener('elsewhere', () => this.loadPatiently(), { signal });
    signal.addEventListener('abort', () => clearTimeout(this.#timer));
  }

  /** Reads the server's list. */
  async load() {
    const version = this.#version;
    /** @type {{attachments: Shown[]}} */
    const { attachments } = await get(`/api/inspections/${this.#inspection}/attachments`, this.#signal);
    if (version !== this.#version) {
      await this.load(); // something was stored meanwhile: the list is older than what is known
      return;
    }
    this.#stored = new Map(attachments.map((item) => [item.id, item]));
    this.#publish();
    this.#awaitPictures();
  }

  /** Like `load`; a server that is away is asked again. */
  loadPatiently() {
    return readOr(this.load(), () => this.#loadLater());
  }

  /** Returns the pictures and the voice notes of an observation, in their order. @param {string} observation */
  of(observation) {
    return this.#byObservation.get(observation) ?? NONE;
  }

  /**
   * Adds a photo of a frame or a drawing on it: {kind, frame, strokes}. Returns its id.
   * @param {Observation} observation
   * @param {{kind: 'photo'|'drawing', frame: number, strokes?: Stroke[]}} picture
   */
  add(observation, picture) {
    const ranks = this.of(observation.id).map(({ rank }) => rank);
    /** @type {Api['Picture']} */
    const body = { strokes: [], rank: Math.max(0, ...ranks) + 1, ...picture };
    /** @type {Shown} */
    const shown = { id: newId(), observation_id: observation.id, ...body, file: null, photo_error: null };
    this.#put(shown, body);
    this.#add('attach', observation, shown);
    return shown.id;
  }

  /**
   * Adds a voice note.
   * @param {Observation} observation
   * @param {Blob} sound
   * @param {number} durationS
   */
  say(observation, sound, durationS) {
    /** @type {Shown} */
    const shown = {
      id: newId(),
      observation_id: observation.id,
      kind: 'voice',
      rank: 0,
      strokes: [],
      duration_s: durationS,
      file: null,
    };
    this.#queue('voice', shown, { shown, sound });
    this.#add('attach', observation, shown);
  }

  /**
   * Replaces the strokes of a drawing.
   * @param {Observation} observation
   * @param {Attachment} item
   * @param {Stroke[]} strokes
   */
  redraw(observation, item, strokes) {
    /** @param {Stroke[]} drawn */
    const draw = (drawn) => this.#put({ ...item, strokes: drawn }, { ...bodyOf(item), strokes: drawn });
    draw(strokes);
    this.#history.add({
      what: 'draw',
      item: observation,
      changes: [],
      run: (isBack) => draw(isBack ? item.strokes : strokes),
      isOvertaken,
    });
  }

  /**
   * Puts the pictures of an observation into another order.
   * @param {Observation} observation
   * @param {(Attachment|null)[]} pictures null is the observation's own photo
   */
  order(observation, pictures) {
    const own = Math.max(0, pictures.indexOf(null));
    const wanted = pictures
      .map((item, i) => ({ item, rank: i - own }))
      .filter(({ item, rank }) => item && item.rank !== rank);
    const before = wanted.map(({ item }) => ({ item, rank: item.rank }));
    /** @param {{item: Attachment, rank: number}[]} ranks */
    const apply = (ranks) => ranks.forEach(({ item, rank }) => this.#put({ ...item, rank }, { ...bodyOf(item), rank }));
    apply(wanted);
    this.#history.add({
      what: 'order',
      item: observation,
      changes: [],
      run: (isBack) => apply(isBack ? before : wanted),
      isOvertaken,
    });
  }

  /** @param {Observation} observation @param {Attachment} item */
  remove(observation, item) {
    this.#queue('delete', item);
    this.#add('detach', observation, item);
  }

  /** Sends what the server has refused again. @param {Attachment} item */
  sendAgain(item) {
    return this.#outbox.sendAgain(item.operation);
  }

  /** Discards what the server has refused. @param {Attachment} item */
  giveUp(item) {
    return this.#outbox.drop(item.operation);
  }

  /** @param {Shown} shown @param {object} body */
  #put(shown, body) {
    this.#queue('put', shown, { shown, body });
  }

  /**
   * @param {'put'|'voice'|'delete'|'restore'} kind
   * @param {Shown} item
   * @param {{shown?: Shown, body?: object, sound?: Blob}} [content]
   */
  #queue(kind, item, content = {}) {
    const { id: attachment, observation_id: observation } = item;
    this.#outbox.add({ inspection: this.#inspection, observation, attachment, kind, ...content });
  }

  /**
   * Adds the step of an attachment that was just added or deleted.
   * @param {'attach'|'detach'} what
   * @param {Observation} observation
   * @param {Shown} item
   */
  #add(what, observation, item) {
    /** @param {boolean} isBack */
    const run = (isBack) => {
      if (isBack === (what === 'attach')) this.#queue('delete', item);
      else this.#queue('restore', item, { shown: item });
    };
    this.#history.add({ what, item: observation, changes: [item], run, isOvertaken });
  }

  /** @param {{operation: import('../server/attachment-outbox.js').Operation, answer: Shown|null}} detail */
  #answered({ operation, answer }) {
    if (operation.inspection !== this.#inspection) return;
    this.#version += 1;
    if (answer) this.#stored.set(answer.id, answer);
    else this.#stored.delete(operation.attachment);
    this.#publish();
    this.#awaitPictures();
  }

  #publish() {
    /** @type {Map<string, any>} */
    const known = new Map([...this.#stored].map(([id, item]) => [id, { ...item, save: 'saved' }]));
    for (const { id: operation, attachment: id, kind, shown, sound, refusal } of this.#outbox.openFor(
      this.#inspection,
    )) {
      const state = refusal ? { save: 'refused', refusal: errorText(refusal), operation } : { save: 'waiting' };
      if (kind !== 'delete') known.set(id, { ...shown, file: known.get(id)?.file ?? shown.file, sound, ...state });
      else if (!refusal) known.delete(id);
      else if (known.has(id)) known.set(id, { ...known.get(id), ...state });
    }
    const items = [...known.values()].sort((a, b) => a.rank - b.rank);
    if (JSON.stringify(items) === JSON.stringify(this.value)) return;
    this.#byObservation = new Map();
    for (const item of items) {
      const { observation_id: observation } = item;
      this.#byObservation.set(observation, [...this.of(observation), item]);
    }
    this.set(items);
  }

  /** Waits for pictures, which are made after their row is stored. */
  #awaitPictures() {
    /** @param {Shown} item */
    const isMissing = ({ kind, file, photo_error: error }) => kind !== 'voice' && !file && !error;
    if ([...this.#stored.values()].some(isMissing)) this.#loadLater();
  }

  #loadLater() {
    clearTimeout(this.#timer);
    if (!this.#signal.aborted) this.#timer = setTimeout(() => this.loadPatiently(), LOAD_PAUSE_MS);
  }
}

/** @param {Shown} item */
const bodyOf = ({ kind, frame, rank, strokes }) => ({ kind, frame, rank, strokes });

/** Each attachment is made by one person, so nobody overtakes a step about it. */
const isOvertaken = async () => false;
