/**
 * Columns of numbers, a value for every frame: read from the server as bytes, kept in arrays that
 * grow, so that the 200,000 frames of two hours cost neither text nor an object each.
 */

import { bodyOf, send } from '../server/api.js';

/**
 * @typedef {Float64Array<ArrayBuffer>|Float32Array<ArrayBuffer>|Uint8Array<ArrayBuffer>} Column
 * @typedef {typeof Float64Array|typeof Float32Array|typeof Uint8Array} ColumnType
 * @typedef {Record<string, Column>} Columns
 */

/** @type {Record<string, ColumnType>} */
const TYPES = { float64: Float64Array, float32: Float32Array, uint8: Uint8Array };
const NEWLINE = 10;

/**
 * Fetches columns in the format of `app/web/columns.py`.
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<{run: string, total: number, rows: number, columns: Columns}>} id of the run, number of rows that
 *     exist and that were fetched, and these by name
 */
async function getColumns(path, signal) {
  const bytes = await bodyOf(await send('GET', path, { signal }), 'arrayBuffer');
  let begin = new Uint8Array(bytes).indexOf(NEWLINE) + 1;
  const { run, total, rows, columns } = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 0, begin)));
  /** @type {Columns} */
  const found = {};
  for (const [name, type] of columns) {
    found[name] = new TYPES[type](bytes, begin, rows);
    begin += found[name].byteLength;
  }
  return { run, total, rows, columns: found };
}

/** The columns of a run, as far as they were fetched. Fires `change` when rows were added or replaced. */
export class RunColumns extends EventTarget {
  #path;
  #types;
  #columns;
  /** Id of the run that made the rows, null before any answer. @type {string|null} */
  run = null;
  /** Number of the newest request for all rows, and of the newest one whose answer is shown. */
  #asked = 0;
  #shown = 0;
  /** Rises when the rows are replaced: everything computed from earlier ones is void. */
  generation = 0;

  /**
   * @param {string} path with a query
   * @param {Record<string, ColumnType>} types array type of each column, by name
   */
  constructor(path, types) {
    super();
    this.#path = path;
    this.#types = types;
    this.#columns = new GrowingColumns(types);
  }

  get length() {
    return this.#columns.length;
  }

  /** Returns one column, for drawing: an array of numbers. @param {string} name @returns {Column} */
  column(name) {
    return this.#columns.column(name);
  }

  /**
   * Fetches the rows that are new since the last call, or all rows if another run has begun.
   * @param {AbortSignal} [signal]
   */
  async extend(signal) {
    const { length, generation } = this;
    const { run, total, rows, columns } = await getColumns(`${this.#path}&since=${length}`, signal);
    const isOvertaken = generation !== this.generation || length !== this.length;
    const isOfAnotherRun = length > 0 && (run !== this.run || total < length);
    if (isOvertaken) await this.extend(signal);
    else if (isOfAnotherRun) await this.reload(signal);
    else this.#add(run, columns, rows);
  }

  /** Fetches all rows again, as their distances have been corrected. @param {AbortSignal} [signal] */
  async reload(signal) {
    this.#asked += 1;
    const asked = this.#asked;
    const { run, total, rows, columns } = await getColumns(`${this.#path}&since=0`, signal);
    if (asked < this.#shown) return; // a newer answer is shown, or the rows were cleared
    const { length } = this;
    this.#shown = asked;
    this.run = run;
    this.#columns.replace(columns, rows);
    this.#begin();
    if (total < length) await this.extend(signal); // rows were added after this request
  }

  clear() {
    this.#asked += 1;
    this.#shown = this.#asked;
    this.run = null;
    this.#columns = new GrowingColumns(this.#types);
    this.#begin();
  }

  /** Forgets what was computed from the earlier rows. */
  began() {}

  /**
   * @param {string} run
   * @param {Columns} columns
   * @param {number} rows
   */
  #add(run, columns, rows) {
    this.run = run;
    if (rows === 0) return;
    this.#columns.extend(columns, rows);
    this.dispatchEvent(new Event('change'));
  }

  #begin() {
    this.generation += 1;
    this.began();
    this.dispatchEvent(new Event('change'));
  }
}

/** Columns of one length that grow at their end. */
class GrowingColumns {
  length = 0;
  /** @type {Columns} */
  #room = {};
  /** @type {Columns} */
  #columns = {};

  /** @param {Record<string, ColumnType>} types array type of each column, by name */
  constructor(types) {
    for (const [name, type] of Object.entries(types)) this.#columns[name] = this.#room[name] = new type(0);
  }

  /** Returns the current values of one column, read-only. @param {string} name */
  column(name) {
    return this.#columns[name];
  }

  /** Replaces all columns; they are not copied. @param {Columns} columns @param {number} length */
  replace(columns, length) {
    this.length = length;
    for (const name of Object.keys(this.#room)) this.#columns[name] = this.#room[name] = columns[name];
  }

  /** Adds rows; unknown columns are ignored. @param {Columns} columns @param {number} rows */
  extend(columns, rows) {
    const length = this.length + rows;
    for (const name of Object.keys(this.#room)) {
      if (this.#room[name].length < length) this.#room[name] = enlarged(this.#columns[name], length);
      this.#room[name].set(columns[name], this.length);
      this.#columns[name] = this.#room[name].subarray(0, length);
    }
    this.length = length;
  }
}

/**
 * Returns a copy with room for at least `length` values; it doubles, so that growing is cheap.
 * @param {Column} column
 * @param {number} length
 * @returns {Column}
 */
function enlarged(column, length) {
  const room = new /** @type {ColumnType} */ (column.constructor)(Math.max(length, 2 * column.length));
  room.set(column);
  return room;
}
