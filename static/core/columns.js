/**
 * Columns of numbers, a value for every frame: read from the server as bytes, kept in arrays that
 * grow, so that the 200,000 frames of two hours cost neither text nor an object each.
 */

import { bodyOf, send } from './api.js';

const TYPES = { float64: Float64Array, float32: Float32Array, uint8: Uint8Array };
const NEWLINE = 10;

/**
 * Fetches columns in the format of `app/web/columns.py`.
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<Object<string, Float64Array|Float32Array|Uint8Array>>} by name, of one length
 */
export async function getColumns(path, signal) {
  const bytes = await bodyOf(await send('GET', path, { signal }), 'arrayBuffer');
  let begin = new Uint8Array(bytes).indexOf(NEWLINE) + 1;
  const { rows, columns } = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 0, begin)));
  const found = {};
  for (const [name, type] of columns) {
    found[name] = new TYPES[type](bytes, begin, rows);
    begin += found[name].byteLength;
  }
  return found;
}

/** Columns of one length that grow at their end. */
export class GrowingColumns {
  length = 0;
  #room = {};
  #columns = {};

  /** @param {Object<string, Function>} types array type of each column, by name */
  constructor(types) {
    for (const [name, type] of Object.entries(types)) this.#columns[name] = this.#room[name] = new type(0);
  }

  /** Returns the current values of one column, read-only. */
  column(name) {
    return this.#columns[name];
  }

  /** Replaces all columns; they are not copied. */
  replace(columns, length) {
    this.length = length;
    for (const name of Object.keys(this.#room)) this.#columns[name] = this.#room[name] = columns[name];
  }

  /** Adds rows; unknown columns are ignored. */
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

/** Returns a copy with room for at least `length` values; it doubles, so that growing is cheap. */
function enlarged(column, length) {
  const room = new column.constructor(Math.max(length, 2 * column.length));
  room.set(column);
  return room;
}
