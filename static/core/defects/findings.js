/**
 * What detectors propose on the wall: a person accepts a finding, which makes it an observation, or rejects it. A
 * decision shows at once, goes to the outbox and can be undone.
 */

import { get, post, remove, readOr } from '../server/api.js';
import { Store } from '../page/store.js';

/**
 * @typedef {Api['FindingOut']} Finding
 * @typedef {{search: Api['FindingsOut']['search'], findings: Finding[]}} Found
 * @typedef {import('../server/outbox.js').Operation} Operation
 */

/** @type {Record<string, Finding['state']>} what each operation makes of a finding */
const STATES = { save: 'accepted', reject: 'rejected', reopen: 'offered' };
/** Pause before the list is read again after a failure, and while the wall is searched. */
const LOAD_PAUSE_MS = 3000;

/** @param {Finding} a @param {Finding} b */
const alongPipe = (a, b) => a.distance_m - b.distance_m || Number(a.id > b.id) - Number(a.id < b.id);

/**
 * Returns the outline of a finding as [corrected distance, arc] in mm: the server states it on the raw wall.
 * @param {Finding} finding
 * @returns {[number, number][]}
 */
export function outlineOf({ outline, from_m: from, to_m: to }) {
  const points = /** @type {[number, number][]} */ (/** @type {unknown} */ (outline));
  const raw = points.map(([mm]) => mm);
  const first = Math.min(...raw);
  const scale = (1000 * (to - from)) / (Math.max(...raw) - first || 1);
  return points.map(([mm, arc]) => [1000 * from + scale * (mm - first), arc]);
}

/** A store of the findings along the pipe; null until they are read. @extends {Store<Found|null>} */
export class Findings extends Store {
  /** Id of the finding that a person looks at. */
  current = new Store(/** @type {string|null} */ (null));
  /** Which of those on offer are shown: a kind, '' for all, and the least score. */
  filter = new Store({ kind: '', least: 0 });

  #path;
  #inspection;
  #outbox;
  #history;
  #observations;
  #signal;
  /** The answer of the server. @type {Found|null} */
  #stored = null;
  #round = 0;
  #timer = 0;

  /**
   * @param {string} inspection
   * @param {import('../server/outbox.js').Outbox} outbox
   * @param {import('./history.js').History} history
   * @param {import('./observations.js').Observations} observations
   * @param {AbortSignal} signal
   */
  constructor(inspection, outbox, history, observations, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/findings`;
    this.#inspection = inspection;
    this.#outbox = outbox;
    this.#history = history;
    this.#observations = observations;
    this.#signal = signal;
    outbox.addEventListener('answered', ({ detail }) => this.#answered(detail.operation), { signal });
    outbox.addEventListener('change', () => this.#show(), { signal });
    signal.addEventListener('abort', () => clearTimeout(this.#timer));
  }

  async load() {
    this.#round += 1;
    const round = this.#round;
    clearTimeout(this.#timer);
    /** @type {Api['FindingsOut']} */
    const { search, findings } = await get(this.#path, this.#signal);
    if (round !== this.#round) return; // a decision has arrived meanwhile, or a newer question
    this.#stored = { search, findings: findings.sort(alongPipe) };
    this.#show();
    if (this.isSearching) this.#loadLater();
  }

  loadPatiently() {
    return readOr(this.load(), () => this.#loadLater());
  }

  #loadLater() {
    clearTimeout(this.#timer);
    if (!this.#signal.aborted) this.#timer = setTimeout(() => this.loadPatiently(), LOAD_PAUSE_MS);
  }

  /** Whether the wall waits for a search, or is searched. */
  get isSearching() {
    return ['waiting', 'searching'].includes(this.#stored?.search.state ?? '');
  }

  /** @param {string|null} id */
  find(id) {
    return this.value?.findings.find((finding) => finding.id === id) ?? null;
  }

  /** @param {Finding['state']} state @returns {Finding[]} */
  in(state) {
    return this.value?.findings.filter((finding) => finding.state === state) ?? [];
  }

  /** Those that wait for a decision and pass the filter, along the pipe. @returns {Finding[]} */
  get queue() {
    const { kind, least } = this.filter.value;
    return this.in('offered').filter((finding) => (!kind || finding.kind === kind) && finding.score >= least);
  }

  /** The finding to look at: the one that was chosen, while it waits, else the next one. */
  get shown() {
    const chosen = this.find(this.current.value);
    return chosen?.state === 'offered' ? chosen : this.next;
  }

  /** The one of the queue that follows along the pipe, after the last one the first. */
  get next() {
    const { queue } = this;
    const here = this.find(this.current.value);
    return (here && queue.find((finding) => alongPipe(finding, here) > 0)) ?? queue[0] ?? null;
  }

  // Decisions -------------------------------------------------------------------------------

  /**
   * Makes an observation of a finding.
   * @param {Finding} finding
   * @param {Partial<import('./observations.js').Fields>} fields
   */
  accept({ id }, fields) {
    this.current.set(id);
    return this.#observations.accept(id, fields);
  }

  /** @param {string} id */
  reject(id) {
    this.#do(id, 'reject');
  }

  /** Offers a rejected finding again. @param {string} id */
  reopen(id) {
    this.#do(id, 'reopen');
  }

  /** @param {string} id @param {'reject'|'reopen'} kind */
  #do(id, kind) {
    /** @param {boolean} isBack */
    const kindOf = (isBack) => (isBack === (kind === 'reject') ? 'reopen' : 'reject');
    this.current.set(id);
    this.#queue(id, kind);
    this.#history.add({
      what: kind,
      run: (isBack) => this.#queue(id, kindOf(isBack)),
      isOvertaken: async (isBack) => {
        await this.loadPatiently();
        return this.find(id)?.state !== STATES[kindOf(!isBack)];
      },
    });
  }

  /** @param {string} id @param {'reject'|'reopen'} kind */
  #queue(id, kind) {
    return this.#outbox.add({ inspection: this.#inspection, observation: id, finding: id, kind });
  }

  /** @param {Operation} operation */
  #answered({ inspection, finding, kind, observation }) {
    if (inspection !== this.#inspection || !finding) return;
    this.#round += 1; // a list that is just being read may be older
    this.#stored = this.#stored && { ...this.#stored, findings: this.#decided([{ finding, kind, observation }]) };
    if (this.isSearching) this.#loadLater();
  }

  /** Shows the stored findings with the decisions that are on their way. */
  #show() {
    if (this.#stored === null) return;
    const waiting = this.#outbox.openFor(this.#inspection).filter(({ finding, refusal }) => finding && !refusal);
    const back = waiting.at(-1);
    const isBack = back?.kind === 'reopen' && this.find(back.finding ?? null)?.state !== 'offered';
    this.set(waiting.length ? { ...this.#stored, findings: this.#decided(waiting) } : this.#stored);
    if (isBack) this.current.set(back.finding ?? null); // what was undone is looked at again
  }

  /** @param {Pick<Operation, 'finding'|'kind'|'observation'>[]} operations @returns {Finding[]} */
  #decided(operations) {
    const last = new Map(operations.map((operation) => [operation.finding, operation]));
    return (this.#stored?.findings ?? []).map((finding) => {
      const { kind, observation } = last.get(finding.id) ?? {};
      if (!kind) return finding;
      return { ...finding, state: STATES[kind], observation_id: kind === 'save' ? (observation ?? null) : null };
    });
  }

  // The search ------------------------------------------------------------------------------

  /** Searches the wall again. @param {string} detector 'classical', or the id of a user's model */
  async search(detector) {
    await post(`${this.#path}/search`, { detector });
    await this.load();
  }

  async cancel() {
    await remove(`${this.#path}/search`);
    await this.load();
  }
}
