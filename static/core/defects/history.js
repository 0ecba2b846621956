/**
 * Undo and redo of one person's changes on one page. Each step can undo and redo its change, and detects
 * whether somebody else has changed the same content meanwhile: then the page warns and overwrites nothing.
 */

/**
 * @typedef {object} Step
 * @property {string} what 'tag', 'accept', 'reject', 'reopen', 'edit', 'delete', 'stretch', 'header', 'restore', 'remark' or
 *     'correction'
 * @property {import('./observations.js').Observation|null} [item] the changed observation, in its earlier state
 * @property {any[]} [changes] the changes, for the name of the step
 * @property {object|null} [visit] of a text field: all letters typed in one visit are one step
 * @property {(isBack: boolean) => unknown} run undoes or redoes it
 * @property {(isBack: boolean) => Promise<boolean>} isOvertaken whether the content has changed
 *     since the step
 *
 * @typedef {object} Outcome
 * @property {Step} step
 * @property {boolean} isBack
 * @property {boolean} isDone false when the content had changed
 * @property {() => Promise<Outcome>} [insist] undoes or redoes it nevertheless
 */

/** Fires `change` when another step can be undone or redone. */
export class History extends EventTarget {
  /** @type {Step[]} */
  #done = [];
  /** @type {Step[]} */
  #undone = [];
  /** @type {Promise<unknown>} */
  #running = Promise.resolve();

  /** The next step to undo, or undefined. */
  get last() {
    return this.#done.at(-1);
  }

  /** The next step to redo, or undefined. */
  get next() {
    return this.#undone.at(-1);
  }

  /** @param {Step} step that was just done */
  add(step) {
    this.#done.push(step);
    this.#undone = [];
    this.#changed();
  }

  /** Replaces the last step, as more is typed, or removes it when nothing has changed. @param {Step|null} [step] */
  replaceLast(step = null) {
    this.#done.splice(-1, 1, ...(step ? [step] : []));
    this.#changed();
  }

  /**
   * Undoes the last step, or the named one; when that fails, the step is kept.
   * @param {Step} [step]
   * @returns {Promise<Outcome|null>} null when there is none, or it was already undone
   */
  undo(step) {
    return this.#inTurn(() => this.#move(true, step));
  }

  /** Redoes the last step that was undone. */
  redo() {
    return this.#inTurn(() => this.#move(false));
  }

  /**
   * @param {boolean} isBack
   * @param {Step} [named]
   * @returns {Promise<Outcome|null>}
   */
  async #move(isBack, named) {
    const [from, to] = isBack ? [this.#done, this.#undone] : [this.#undone, this.#done];
    const step = named ?? from.at(-1);
    if (!from.includes(step)) return null;
    const isOvertaken = await step.isOvertaken(isBack);
    /** @returns {Promise<Outcome>} */
    const go = async () => {
      await step.run(isBack);
      to.push(step);
      this.#changed();
      return { step, isBack, isDone: true };
    };
    // A step that was overtaken is removed, so that earlier ones can still be undone.
    if (!isOvertaken) await step.run(isBack);
    from.splice(from.indexOf(step), 1);
    if (!isOvertaken) to.push(step);
    this.#changed();
    return { step, isBack, isDone: !isOvertaken, insist: () => this.#inTurn(go) };
  }

  /**
   * Runs steps in turn: two quick key strokes are two steps, one after the other.
   * @template T
   * @param {() => Promise<T>} run
   * @returns {Promise<T>}
   */
  #inTurn(run) {
    const result = this.#running.then(run);
    this.#running = result.then(
      () => {},
      () => {},
    ); // the caller handles its failure
    return result;
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}
