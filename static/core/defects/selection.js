/** Which rows of a list are selected: single ones, over all pages, or all that fit the filters. */

/**
 * Fires `change`.
 * @template {{id: string}} Item
 * @template [Where=Record<string, string|boolean>] how the list that is selected from writes its filters
 */
export class Selection extends EventTarget {
  /** @type {Map<string, Item>} */
  #items = new Map();
  /**
   * {where, total} while all that fit are meant; null for single ones.
   * @type {{where: Where, total: number}|null}
   */
  #all = null;
  /** Id of the item that was marked last: a range begins there. @type {string|null} */
  #last = null;

  get isAll() {
    return this.#all !== null;
  }

  get size() {
    return this.#all?.total ?? this.#items.size;
  }

  /** The single items as they were when they were selected. */
  get items() {
    return [...this.#items.values()];
  }

  /** What the API takes: the ids, or the filters. */
  get meant() {
    return this.#all ? { where: this.#all.where } : { ids: [...this.#items.keys()] };
  }

  /** @param {string} id */
  has(id) {
    return this.isAll || this.#items.has(id);
  }

  /**
   * Selects or leaves out some items; what was "all" becomes these alone.
   * @param {Item[]} items
   * @param {boolean} isSelected
   */
  mark(items, isSelected) {
    this.#all = null;
    for (const item of items) {
      if (isSelected) this.#items.set(item.id, item);
      else this.#items.delete(item.id);
    }
    this.#changed();
  }

  /**
   * Selects or leaves out one item of a page, or all from the one that was marked last to it. Of "all" the rest of
   * the page stays: the other pages are not known one by one.
   * @param {Item[]} page
   * @param {string} id
   * @param {{isSelected: boolean, isRange: boolean}} how
   */
  markOne(page, id, { isSelected, isRange }) {
    const to = page.findIndex((item) => item.id === id);
    const last = isRange ? page.findIndex((item) => item.id === this.#last) : -1;
    const from = last < 0 ? to : last;
    this.#last = id;
    if (this.isAll) this.mark(page, true);
    this.mark(page.slice(Math.min(from, to), Math.max(from, to) + 1), isSelected);
  }

  /** Selects all that fit the filters, on every page. @param {Where} where @param {number} total */
  markAll(where, total) {
    this.#items.clear();
    this.#all = { where, total };
    this.#changed();
  }

  /**
   * Leaves out items that no longer exist; `total`: what fits the filters without them.
   * @param {string[]} ids
   * @param {number} total
   */
  forget(ids, total) {
    for (const id of ids) this.#items.delete(id);
    if (this.isAll) this.#all.total = total;
    this.#changed();
  }

  clear() {
    this.#items.clear();
    this.#all = null;
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}
