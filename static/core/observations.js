/**
 * The tagged points of one inspection. Every change shows at once, goes to the outbox, and can be
 * undone; the server's answer replaces the estimated distance by the exact one.
 */

import { ApiError, get } from './api.js';
import { Store } from './store.js';

/** What a person enters; everything else is derived by the server. */
const FIELDS = [
  'frame', 'pixel', 'code', 'char1', 'char2', 'quant1', 'quant2', 'clock_from', 'clock_to',
  'severity', 'continuous', 'remark',
];

/** How long the server may take for a photo before it is asked again. */
const PHOTO_PAUSE_MS = 1500;

const byDistance = (a, b) =>
  (a.distance_m ?? Infinity) - (b.distance_m ?? Infinity) || a.frame - b.frame;

const fieldsOf = (observation) =>
  Object.fromEntries(
    FIELDS.filter((name) => observation[name] !== undefined).map((name) => [name, observation[name]]),
  );

/** Random UUID; `crypto.randomUUID` exists only over https and on localhost. */
function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const hex = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, '$1-$2-$3-$4-$5');
}

/**
 * A store of observations sorted by distance. Beside the fields of the API each has
 * `save`: 'saved' | 'waiting' | 'refused', and `refusal`, the reason of the last.
 */
export class Observations extends Store {
  #inspection;
  #outbox;
  #signal;
  #deleted = new Map();
  #undo = [];
  #version = 0;
  #photoTimer = 0;

  /**
   * @param {string} inspection
   * @param {import('./outbox.js').Outbox} outbox
   * @param {AbortSignal} signal
   */
  constructor(inspection, outbox, signal) {
    super([]);
    this.#inspection = inspection;
    this.#outbox = outbox;
    this.#signal = signal;
    outbox.addEventListener('answered', (event) => this.#answered(event.detail), { signal });
    outbox.addEventListener('refused', (event) => this.#refused(event.detail), { signal });
  }

  /** Reads the server's list and lays what is still in the outbox over it. */
  async load() {
    const version = this.#version;
    const { observations } = await get(this.#path, this.#signal);
    if (version !== this.#version) {
      await this.load(); // something changed meanwhile: the list is older than what is shown
      return;
    }
    const known = new Map(observations.map((item) => [item.id, { ...item, save: 'saved' }]));
    for (const { observation, kind, fields } of this.#outbox.waitingFor(this.#inspection)) {
      if (kind === 'delete') known.delete(observation);
      if (kind === 'save') {
        known.set(observation, {
          ...unsaved(observation),
          ...known.get(observation),
          ...fields,
          save: 'waiting',
        });
      }
    }
    this.#publish([...known.values()]);
    this.#awaitPhotos();
  }

  find(id) {
    return this.value.find((item) => item.id === id) ?? null;
  }

  get canUndo() {
    return this.#undo.length > 0;
  }

  /**
   * @param {object} fields as in the API
   * @param {object} estimate {distance_m, distance_u95_m, clock, time_s}, shown until the server answers
   */
  create(fields, estimate) {
    const id = newId();
    const created = { ...unsaved(id), ...estimate, ...fields, save: 'waiting' };
    this.#publish([...this.value, created]);
    this.#queue('save', id, fieldsOf(created));
    this.#undo.push({ what: 'tag', id, run: () => this.#remove(id) });
    return created;
  }

  edit(id, changes) {
    const before = this.find(id);
    if (!before) return; // deleted elsewhere meanwhile
    if (Object.entries(changes).every(([name, value]) => same(before[name], value))) return;
    const previous = Object.fromEntries(
      Object.keys(changes).map((name) => [name, before[name] ?? null]),
    );
    this.#save(id, changes);
    this.#undo.push({ what: 'edit', id, run: () => this.#save(id, previous) });
  }

  remove(id) {
    this.#remove(id);
    this.#undo.push({ what: 'delete', id, run: () => this.#restore(id) });
  }

  /** Takes back the last change that still can be; answers what it was, or null. */
  undo() {
    let step;
    let observation;
    do {
      step = this.#undo.pop();
      if (!step) return null;
      observation = step.what === 'delete' ? this.#deleted.get(step.id) : this.find(step.id);
    } while (!observation);
    step.run();
    return { what: step.what, observation };
  }

  get #path() {
    return `/api/inspections/${this.#inspection}/observations`;
  }

  #save(id, changes) {
    const item = { ...this.find(id), ...changes, save: 'waiting' };
    this.#replace(item);
    this.#queue('save', id, fieldsOf(item));
  }

  #remove(id) {
    this.#deleted.set(id, this.find(id));
    this.#publish(this.value.filter((item) => item.id !== id));
    this.#queue('delete', id);
  }

  #restore(id) {
    const item = { ...this.#deleted.get(id), save: 'waiting' };
    this.#deleted.delete(id);
    this.#publish([...this.value, item]);
    this.#queue('restore', id);
  }

  #queue(kind, observation, fields) {
    this.#version += 1;
    return this.#outbox.add({ inspection: this.#inspection, observation, kind, fields });
  }

  #answered({ operation, answer }) {
    const item = this.find(operation.observation);
    if (!item || operation.inspection !== this.#inspection || !answer) return;
    // A newer change of this observation is on its way: keep what the person entered.
    const isNewest = !this.#outbox.isWaiting(item.id);
    this.#version += 1;
    this.#replace(
      isNewest
        ? { ...answer, save: 'saved' }
        : { ...answer, ...fieldsOf(item), save: 'waiting' },
    );
    this.#awaitPhotos();
  }

  /** A photo is cut after its observation is safe, so it comes a little later. */
  #awaitPhotos() {
    clearTimeout(this.#photoTimer);
    const isMissing = ({ save, photo, photo_error: error }) => save === 'saved' && !photo && !error;
    if (this.#signal.aborted || !this.value.some(isMissing)) return;
    this.#photoTimer = setTimeout(() => this.#loadPatiently(), PHOTO_PAUSE_MS);
  }

  async #loadPatiently() {
    try {
      await this.load();
    } catch (error) {
      if (!(error instanceof ApiError && error.isTemporary)) throw error;
      this.#awaitPhotos();
    }
  }

  #refused({ operation, error }) {
    const item = this.find(operation.observation);
    if (item) this.#replace({ ...item, save: 'refused', refusal: error.message });
  }

  #replace(item) {
    this.#publish(this.value.map((other) => (other.id === item.id ? item : other)));
  }

  #publish(items) {
    this.set(items.toSorted(byDistance));
  }
}

const unsaved = (id) => ({
  id, code: null, distance_m: null, distance_u95_m: null, clock: null, photo: null, severity: null,
  remark: null,
});

const same = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
