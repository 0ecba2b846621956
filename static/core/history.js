/**
 * What one person has done on one page, to be taken back and done again in turn. A step knows how
 * to do both, and whether somebody else has changed the same thing meanwhile: then it is said
 * instead of overwritten.
 */

/**
 * @typedef {object} Step
 * @property {string} what 'tag', 'edit', 'delete', 'stretch', 'header' or 'correction'
 * @property {object} [item] the observation that it is about, as it was then
 * @property {object[]} [changes] what it changed, for its name
 * @property {object|null} [visit] of a field that is typed in: all its letters are one step
 * @property {(isBack: boolean) => Promise<void>|void} run takes it back, or does it again
 * @property {(isBack: boolean) => Promise<boolean>} isOvertaken whether the thing is no longer as the step left it
 *
 * @typedef {object} Outcome
 * @property {Step} step
 * @property {boolean} isBack
 * @property {boolean} isDone false when it was overtaken
 * @property {() => Promise<Outcome>} insist does it nevertheless
 */

/** Fires `change` when there is something else to take back or to do again. */
export class History extends EventTarget {
  #done = [];
  #undone = [];
  #running = Promise.resolve();

  /** The step that would be taken back, or undefined. */
  get last() {
    return this.#done.at(-1);
  }

  /** The step that would be done again, or undefined. */
  get next() {
    return this.#undone.at(-1);
  }

  /** @param {Step} step that was just done */
  add(step) {
    this.#done.push(step);
    this.#undone = [];
    this.#changed();
  }

  /** Puts another step in the place of the last one, as more is typed, or none: it is as before. */
  replaceLast(step = null) {
    this.#done.splice(-1, 1, ...(step ? [step] : []));
    this.#changed();
  }

  /**
   * Takes back the last step, or the named one; fails, and keeps it, when that does.
   * @param {Step} [step]
   * @returns {Promise<Outcome|null>} null when there is none, or it was taken back already
   */
  undo(step) {
    return this.#inTurn(() => this.#move(true, step));
  }

  /** Does again what was taken back last. */
  redo() {
    return this.#inTurn(() => this.#move(false));
  }

  async #move(isBack, named) {
    const [from, to] = isBack ? [this.#done, this.#undone] : [this.#undone, this.#done];
    const step = named ?? from.at(-1);
    if (!from.includes(step)) return null;
    const isOvertaken = await step.isOvertaken(isBack);
    const go = async () => {
      await step.run(isBack);
      to.push(step);
      this.#changed();
      return { step, isBack, isDone: true };
    };
    // One that was overtaken leaves its place, so that those before it can still be taken back.
    if (!isOvertaken) await step.run(isBack);
    from.splice(from.indexOf(step), 1);
    if (!isOvertaken) to.push(step);
    this.#changed();
    return { step, isBack, isDone: !isOvertaken, insist: () => this.#inTurn(go) };
  }

  /** Two quick strokes of a key are two steps, one after the other. */
  #inTurn(run) {
    const result = this.#running.then(run);
    this.#running = result.then(() => {}, () => {}); // its failure is its caller's
    return result;
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}
