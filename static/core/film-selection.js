/** Which films of the archive are selected: single ones, over all pages, or all that fit the filters. */

/** Fires `change`. */
export class FilmSelection extends EventTarget {
  #films = new Map();
  /** {where, total} while all that fit are meant; null for single ones. */
  #all = null;

  get isAll() {
    return this.#all !== null;
  }

  get size() {
    return this.#all?.total ?? this.#films.size;
  }

  /** The single films as they were when they were selected. */
  get films() {
    return [...this.#films.values()];
  }

  /** What the API takes: the ids, or the filters. */
  get meant() {
    return this.#all ? { where: this.#all.where } : { ids: [...this.#films.keys()] };
  }

  has(id) {
    return this.isAll || this.#films.has(id);
  }

  /** Selects or leaves out some films; what was "all" becomes these alone. */
  mark(films, isSelected) {
    this.#all = null;
    for (const film of films) {
      if (isSelected) this.#films.set(film.id, film);
      else this.#films.delete(film.id);
    }
    this.#changed();
  }

  /** Selects all that fit the filters, on every page. */
  markAll(where, total) {
    this.#films.clear();
    this.#all = { where, total };
    this.#changed();
  }

  clear() {
    this.#films.clear();
    this.#all = null;
    this.#changed();
  }

  #changed() {
    this.dispatchEvent(new Event('change'));
  }
}
