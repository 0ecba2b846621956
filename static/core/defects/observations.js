/**
 * The observations of one inspection. Every change shows at once, goes to the outbox and can be undone; the
 * server's answer replaces the estimated distance by the exact one.
 */

import { ApiError, get, readOr } from '../server/api.js';
import { newId } from '../page/new-id.js';
import { Store } from '../page/store.js';
import { partsOf, stretchNumber } from './stretches.js';
import { errorText } from '../page/words.js';

/**
 * @typedef {Required<Api['Tag']>} Fields those that a person enters; the server derives all others
 *
 * @typedef {object} Saving
 * @property {string|null} version of the saved fields; null while they are not saved
 * @property {'saved'|'waiting'|'refused'} save
 * @property {string|null} [refusal] the reason of a refusal
 * @property {boolean} [isDeleted] its deletion was refused, so it is shown as stored
 *
 * @typedef {Pick<Api['ObservationOut'], 'distance_m'|'distance_u95_m'|'clock'>
 *     & {time_s?: number|null}} Place as far as the page knows it
 * @typedef {Fields & Saving & Place & Pick<Api['ObservationOut'], 'id'|'photo'>
 *     & Omit<Partial<Api['ObservationOut']>, keyof Fields|'version'>} Observation
 *
 * @typedef {import('../server/stored-outbox.js').Refusal} Refusal
 * @typedef {(kind: 'save'|'delete'|'reopen', observation: string, fields?: Fields,
 *     made?: {before?: Partial<Fields>|null, version?: string|null, finding?: string}) => unknown} Queue
 */

/** Fields that a person enters; the server derives all others. */
/** @type {(keyof Fields)[]} */
const FIELDS = [
  'frame',
  'pixel',
  'code',
  'char1',
  'char2',
  'quant1',
  'quant2',
  'clock_from',
  'clock_to',
  'severity',
  'continuous',
  'remark',
  'recommendation',
  'cost',
  'measures',
];
/** Fields that are equal throughout a stretch. */
const SHARED = ['code', 'char1', 'char2'];

/** Pause before the list is read again, for a missing photo or after a failure. */
const LOAD_PAUSE_MS = 1500;
/** Time after which a silent server counts as unreachable. */
const LOOK_LIMIT_MS = 3000;

/** @param {Observation} a @param {Observation} b */
const byDistance = (a, b) => (a.distance_m ?? Infinity) - (b.distance_m ?? Infinity) || a.frame - b.frame;

/** @param {Partial<Fields>} observation */
const fieldsOf = (observation) =>
  /** @type {Fields} */ (Object.fromEntries(FIELDS.map((name) => [name, observation[name] ?? null])));

/**
 * @typedef {object} Change
 * @property {string} id of the observation
 * @property {Partial<Fields>|null} before the fields that change, null when it was not there
 * @property {Partial<Fields>|null} after
 * @property {string} [finding] that it is made of
 */

/**
 * A store of observations sorted by distance.
 * @extends {Store<Observation[]>}
 */
export class Observations extends Store {
  /** Whether the server's list has been read. */
  isRead = false;

  #inspection;
  #outbox;
  #history;
  #placeOf;
  #signal;
  #nextStretch = 1;
  #version = 0;
  #timer = 0;

  /**
   * @param {string} inspection
   * @param {import('../server/outbox.js').Outbox} outbox
   * @param {import('./history.js').History} history
   * @param {(frame: number, pixel: number[]|null) => Place} placeOf shown until the server answers
   * @param {AbortSignal} signal
   */
  constructor(inspection, outbox, history, placeOf, signal) {
    super([]);
    this.#inspection = inspection;
    this.#outbox = outbox;
    this.#history = history;
    this.#placeOf = placeOf;
    this.#signal = signal;
    outbox.addEventListener('answered', (event) => this.#answered(event.detail), { signal });
    outbox.addEventListener('refused', (event) => this.#refused(event.detail), { signal });
    outbox.addEventListener('elsewhere', () => this.#loadPatiently(), { signal });
  }

  /** Reads the server's list and applies what is still in the outbox. */
  async load(signal = this.#signal) {
    const version = this.#version;
    /** @type {Api['ObservationsOut']} */
    const { observations, next_stretch: next } = await get(this.#path, signal);
    if (version !== this.#version) {
      await this.load(signal); // something changed meanwhile: the list is older than what is shown
      return;
    }
    /** @type {Map<string, any>} */
    const known = new Map(observations.map((item) => [item.id, { ...item, save: 'saved' }]));
    for (const { observation, kind, fields, refusal } of this.#outbox.openFor(this.#inspection)) {
      if (kind !== 'save' && refusal && known.has(observation)) {
        known.set(observation, undeleted(known.get(observation), refusal));
      } else if (kind !== 'save') {
        known.delete(observation);
      } else {
        known.set(observation, {
          ...unsaved(observation),
          ...(known.get(observation) ?? this.#placeOf(fields.frame, fields.pixel)),
          ...fields,
          version: null,
          ...(refusal ? { save: 'refused', refusal: errorText(refusal) } : { save: 'waiting' }),
        });
      }
    }
    this.#nextStretch = Math.max(this.#nextStretch, next);
    const items = this.#asKnown([...known.values()]);
    const shown = new Set(this.value);
    const isNews = !this.isRead || items.length !== shown.size || items.some((item) => !shown.has(item));
    this.isRead = true;
    if (isNews) this.#publish(items); // most lists are read because of the page's own change
    this.#awaitPhotos();
  }

  /** Keeps the objects of unchanged items, so that nothing is computed again. @param {Observation[]} items */
  #asKnown(items) {
    const before = new Map(this.value.map((item) => [item.id, item]));
    return items.map((item) => (isSame(before.get(item.id), item) ? before.get(item.id) : item));
  }

  /** @param {string} id */
  find(id) {
    return this.value.find((item) => item.id === id) ?? null;
  }

  /** The first stretch number that this inspection never used. */
  get nextStretch() {
    return this.#nextStretch;
  }

  /** @param {Partial<Fields>} fields */
  create(fields) {
    const id = newId();
    this.#do('tag', [{ id, before: null, after: fieldsOf(fields) }]);
    return this.find(id);
  }

  /** Makes an observation of a finding. @param {string} finding its id @param {Partial<Fields>} fields */
  accept(finding, fields) {
    const id = newId();
    this.#do('accept', [{ id, before: null, after: fieldsOf(fields), finding }]);
    return this.find(id);
  }

  /**
   * Edits an observation; code and characters change throughout its stretch.
   * @param {string} id
   * @param {Partial<Fields>} changes
   * @param {Partial<Fields>} [seen] what the person saw in the changed fields, if that may no longer be what is stored
   */
  edit(id, changes, seen) {
    this.#do('edit', this.#editOf(id, changes), seen);
  }

  /**
   * Like `edit`, for every typed letter: it is safe in this browser at once and sent after a pause in
   * typing. All letters of one visit of a field are one undo step.
   * @param {string} id
   * @param {Partial<Fields>} changes
   * @param {object} visit the same object as long as the field has the focus
   * @param {Partial<Fields>} [seen] as in `edit`
   */
  type(id, changes, visit, seen) {
    const item = this.find(id);
    const edited = this.#editOf(id, changes).filter(isReal);
    if (edited.length === 0) return;
    this.#apply(edited, false, seen, (...operation) => this.#queueTyped(...operation));
    const { last } = this.#history;
    if (last?.visit !== visit) {
      this.#history.add({ ...this.#step('edit', edited, item), visit });
      return;
    }
    /** @param {Change} change */
    const beforeOf = (change) => last.changes.find(({ id: other }) => other === change.id)?.before;
    const whole = edited.map((change) => ({ ...change, before: beforeOf(change) ?? change.before })).filter(isReal);
    this.#history.replaceLast(whole.length ? { ...this.#step('edit', whole, last.item), visit } : null);
  }

  /**
   * @param {string} id
   * @param {Partial<Fields>} changes
   * @returns {Change[]}
   */
  #editOf(id, changes) {
    const item = this.find(id);
    if (!item) return []; // deleted elsewhere meanwhile
    const shared = Object.fromEntries(Object.entries(changes).filter(([name]) => SHARED.includes(name)));
    const others = partsOf(this.value, item).filter((part) => part.id !== id);
    return [changeOf(item, changes), ...others.map((part) => changeOf(part, shared))];
  }

  /** Changes several observations in one step: [id, changes] for each. @param {[string, Partial<Fields>][]} edits */
  editTogether(edits) {
    this.#do(
      'stretch',
      edits.map(([id, changes]) => changeOf(this.find(id), changes)),
    );
  }

  /** Turns a stretch into a point at its start. @param {string|number} number */
  makePoint(number) {
    const [start, ...others] = partsOf(this.value, { continuous: `A${number}` });
    this.#do('stretch', [
      changeOf(start, { continuous: null }),
      ...others.map((part) => /** @type {Change} */ ({ id: part.id, before: fieldsOf(part), after: null })),
    ]);
  }

  /** @param {string} id */
  remove(id) {
    this.#do('delete', [{ id, before: fieldsOf(this.find(id)), after: null }]);
  }

  /**
   * Gives an observation the fields of an earlier version; one that was deleted since is there again.
   * @returns {boolean} whether that is a change
   * @param {string} id
   * @param {Partial<Fields>} fields
   */
  restore(id, fields) {
    const item = this.find(id);
    const change = { id, before: item ? fieldsOf(item) : null, after: fieldsOf(fields) };
    this.#do('restore', [change]);
    return isReal(change);
  }

  /** Sends the refused change of an observation again. @param {string} id */
  sendAgain(id) {
    const item = this.find(id);
    if (item?.isDeleted) return this.remove(id); // as it is now, so that undo brings this back
    this.#version += 1;
    if (item) this.#replace({ ...item, save: 'waiting' });
    return this.#outbox.sendAgain(id);
  }

  /** Discards the refused changes of an observation and returns to the server's state. @param {string} id */
  async giveUp(id) {
    const overtaken = this.#outbox.overtakenFor(this.#inspection).findLast((other) => other.observation === id);
    if (overtaken) this.#showStored(id, overtaken.refusal);
    await this.#outbox.drop(id);
    await this.#loadPatiently();
  }

  /**
   * Shows the version that overtook a change, so that what is changed next is based on it.
   * @param {string} id
   * @param {Refusal} refusal
   */
  #showStored(id, { current, version }) {
    const item = this.find(id);
    if (!current || !item) {
      this.#publish(this.#without(id));
      return;
    }
    const place = this.#placeOf(current.frame, current.pixel);
    this.#replace({ ...item, ...place, ...fieldsOf(current), version, save: 'saved', refusal: null, isDeleted: false });
  }

  // Steps -----------------------------------------------------------------------------------

  /**
   * @param {Change[]} changes changes without effect are dropped
   * @param {string} what
   * @param {Partial<Fields>} [seen]
   */
  #do(what, changes, seen) {
    const real = changes.filter(isReal);
    if (real.length === 0) return;
    const item = this.find(real[0].id);
    this.#apply(real, false, seen);
    this.#history.add(this.#step(what, real, item));
  }

  /**
   * @param {Observation|null} item its earlier state, null when it did not exist
   * @param {string} what
   * @param {Change[]} changes
   * @returns {import('./history.js').Step}
   */
  #step(what, changes, item) {
    return {
      what,
      item: item ?? this.find(changes[0].id),
      changes,
      run: (isBack) => this.#apply(changes, isBack),
      isOvertaken: (isBack) => this.#isOvertaken(changes, isBack),
    };
  }

  /**
   * @param {Change[]} changes
   * @param {boolean} isBack
   * @param {Partial<Fields>} [seen]
   * @param {Queue} [queue]
   */
  #apply(changes, isBack, seen, queue = (...operation) => this.#queue(...operation)) {
    for (const { id, before, after, finding } of changes) {
      const [from, to] = isBack ? [after, before] : [before, after];
      if (to === null) this.#remove(id, finding);
      else if (from === null) this.#bring(id, /** @type {Fields} */ (to), finding);
      else if (this.find(id)) this.#save(id, to, seen, queue);
    }
  }

  /**
   * Whether one of them has changed since; looked up on the server, unless it is unreachable.
   * @param {Change[]} changes
   * @param {boolean} isBack
   */
  async #isOvertaken(changes, isBack) {
    try {
      await this.load(AbortSignal.any([this.#signal, AbortSignal.timeout(LOOK_LIMIT_MS)]));
    } catch (error) {
      if (!(error instanceof ApiError && error.isTemporary)) throw error;
    }
    return changes.some(({ id, before, after }) => {
      const found = this.find(id);
      const now = found?.isDeleted ? null : found;
      const left = isBack ? after : before;
      if (left === null || now === null) return left !== now;
      return Object.entries(left).some(([name, value]) => !isSame(now[/** @type {keyof Fields} */ (name)], value));
    });
  }

  // Changes ---------------------------------------------------------------------------------

  get #path() {
    return `/api/inspections/${this.#inspection}/observations`;
  }

  /**
   * @param {string} id
   * @param {Partial<Fields>} changes
   * @param {Partial<Fields>|undefined} seen
   * @param {Queue} queue
   */
  #save(id, changes, seen, queue) {
    const before = this.find(id);
    /** @type {Observation} */
    const item = { ...before, ...changes, save: 'waiting', version: null, isDeleted: false };
    const isMoved = 'frame' in changes || 'pixel' in changes;
    const place = isMoved ? { ...this.#placeOf(item.frame, item.pixel), photo: null, photo_error: null } : {};
    const clock = 'clock_from' in changes && {
      clock: item.clock_from ?? this.#placeOf(item.frame, item.pixel).clock,
    };
    const figures = 'measures' in changes && /** @type {Partial<Observation>} */ ({ measured: null });
    this.#replace({ ...item, ...place, ...clock, ...figures });
    queue('save', id, fieldsOf(item), madeOf(before, seen));
  }

  /**
   * Shows an observation that was not there, or whose deletion was refused.
   * @param {string} id
   * @param {Fields} fields
   * @param {string} [finding]
   */
  #bring(id, fields, finding) {
    const place = this.#placeOf(fields.frame, fields.pixel);
    this.#publish([...this.#without(id), { ...unsaved(id), ...place, ...fields, save: 'waiting' }]);
    this.#queue('save', id, fields, finding ? { finding } : undefined);
  }

  /** Removes an observation; one that was made of a finding by offering that again. @param {string} id @param {string} [finding] */
  #remove(id, finding) {
    const item = this.find(id);
    if (!item) return; // deleted elsewhere meanwhile
    this.#publish(this.#without(id));
    if (finding) this.#queue('reopen', id, undefined, { ...madeOf(item), finding });
    else this.#queue('delete', id, undefined, madeOf(item));
  }

  /** @param {string} id */
  #without(id) {
    return this.value.filter((item) => item.id !== id);
  }

  /** @type {Queue} */
  #queue(kind, observation, fields, madeOf) {
    this.#version += 1;
    return this.#outbox.add({ inspection: this.#inspection, observation, kind, fields, ...madeOf });
  }

  /** @type {Queue} */
  #queueTyped(kind, observation, fields, madeOf) {
    this.#version += 1;
    return this.#outbox.addTyped({ inspection: this.#inspection, observation, kind, fields, ...madeOf });
  }

  /** @param {{operation: import('../server/outbox.js').Operation, answer: Api['ObservationOut']|null}} detail */
  #answered({ operation, answer }) {
    if (operation.inspection !== this.#inspection) return;
    this.#version += 1; // a list that is just being read may be older, and still hold what was deleted
    const item = this.find(operation.observation);
    if (!answer) {
      // Decided before this tab had read that the deletion was refused.
      if (item && !this.#outbox.isWaiting(item.id)) this.#publish(this.#without(item.id));
      return;
    }
    if (!item) {
      this.#loadPatiently(); // from another tab, made while the list could not be read
      return;
    }
    // A newer change of this observation is on its way: keep what the person entered.
    const isNewest = !this.#outbox.isWaiting(item.id);
    // Before its frame is tracked, the server knows no distance, but the live picture had one.
    const { distance_m, distance_u95_m, clock, time_s } = item;
    const place = answer.distance_m === null ? { distance_m, distance_u95_m, clock, time_s } : {};
    this.#replace(
      isNewest
        ? { ...answer, ...place, save: 'saved' }
        : { ...answer, ...place, ...fieldsOf(item), save: 'waiting', version: null },
    );
    this.#awaitPhotos();
  }

  /** Waits for photos, which are made after their observation is stored. */
  #awaitPhotos() {
    clearTimeout(this.#timer);
    /** @param {Observation} item */
    const isMissing = ({ save, photo, photo_error: error }) => save === 'saved' && !photo && !error;
    if (this.value.some(isMissing)) this.#loadLater();
  }

  #loadLater() {
    clearTimeout(this.#timer);
    if (this.#signal.aborted) return;
    this.#timer = setTimeout(() => this.#loadPatiently(), LOAD_PAUSE_MS);
  }

  #loadPatiently() {
    return readOr(this.load(), () => this.#loadLater());
  }

  /** @param {{operation: import('../server/outbox.js').Operation, error: ApiError}} detail */
  #refused({ operation, error }) {
    if (operation.inspection !== this.#inspection) return;
    const item = this.find(operation.observation);
    if (operation.kind !== 'save') this.#showAgain(operation.observation, error);
    else if (item) this.#replace({ ...item, save: 'refused', refusal: errorText(error) });
  }

  /**
   * Shows an observation whose deletion was refused: at once as far as the page knows it, then as it is stored.
   * @param {string} id
   * @param {Refusal} refusal
   */
  #showAgain(id, refusal) {
    const { current } = refusal;
    const place = current && this.#placeOf(current.frame, current.pixel);
    if (current) this.#publish([...this.#without(id), undeleted({ ...unsaved(id), ...place }, refusal)]);
    this.#loadPatiently();
  }

  /** @param {Observation} item */
  #replace(item) {
    this.#publish(this.value.map((other) => (other.id === item.id ? item : other)));
  }

  /** @param {Observation[]} items */
  #publish(items) {
    const used = items.map((item) => stretchNumber(item) ?? 0);
    this.#nextStretch = Math.max(this.#nextStretch, ...used.map((number) => number + 1));
    this.set(items.toSorted(byDistance));
  }
}

/** @param {string} id @returns {Observation} */
const unsaved = (id) =>
  /** @type {Observation} */ ({
    id,
    code: null,
    distance_m: null,
    distance_u95_m: null,
    clock: null,
    photo: null,
    severity: null,
    remark: null,
    version: null,
  });

/**
 * Returns an observation whose deletion was refused, as it was stored then.
 * @param {Observation} item
 * @param {Refusal} refusal
 * @returns {Observation}
 */
const undeleted = (item, refusal) => ({
  ...item,
  ...(refusal.current && { ...fieldsOf(refusal.current), version: refusal.version }),
  save: 'refused',
  refusal: errorText(refusal),
  isDeleted: true,
});

/**
 * Returns what a change of an observation is based on. Where the person saw something else than what is stored,
 * that is of no stored version, so the server refuses the change and the person decides.
 * @param {Observation} item
 * @param {Partial<Fields>} [seen]
 */
function madeOf(item, seen = {}) {
  const isStored = Object.entries(seen).every(([name, value]) =>
    isSame(item[/** @type {keyof Fields} */ (name)], value),
  );
  return { before: { ...fieldsOf(item), ...seen }, version: isStored ? item.version : null };
}

/**
 * Returns the change of an observation, before and after.
 * @param {Observation} item
 * @param {Partial<Fields>} changes
 * @returns {Change}
 */
const changeOf = (item, changes) => ({
  id: item.id,
  before: Object.fromEntries(
    Object.keys(changes).map((name) => [name, item[/** @type {keyof Fields} */ (name)] ?? null]),
  ),
  after: changes,
});

/** @param {Change} change */
const isReal = ({ before, after }) => !before || !after || !isSame(before, after);

/** @param {unknown} a @param {unknown} b */
const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
