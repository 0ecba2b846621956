/** The code catalogue: search, labels, and which details a code needs. */

import { get } from './api.js';

/**
 * @typedef {object} CodeRow
 * @property {string} code
 * @property {string} char1 '' when not used
 * @property {string} char2
 * @property {string} label 'Crack: hairline on the surface, along the pipe'
 */

export class Catalogue {
  #rows;
  #byCode;

  static async load(signal) {
    return new Catalogue(await get('/api/codes', signal));
  }

  /** @param {CodeRow[]} rows */
  constructor(rows) {
    this.#rows = rows;
    this.#byCode = Map.groupBy(rows, (row) => row.code);
  }

  has(code) {
    return this.#byCode.has(code);
  }

  /** The row of a full code, or the first of its main code. */
  row(code, char1, char2) {
    const rows = this.#byCode.get(code);
    return (
      rows?.find((row) => row.char1 === (char1 ?? '') && row.char2 === (char2 ?? '')) ??
      rows?.find((row) => row.char1 === (char1 ?? '')) ??
      rows?.[0] ??
      null
    );
  }

  /** What the thing is, as far as it is known. */
  label(code, char1, char2) {
    const rows = this.#byCode.get(code);
    if (!rows) return code ? 'Code not in the catalogue' : 'No code yet';
    const exact = rows.find(
      (row) => row.char1 === (char1 ?? '') && row.char2 === (char2 ?? ''),
    );
    return exact?.label ?? title(rows[0].label);
  }

  /** First letters that the code allows: [{value, label}]. */
  firstChars(code) {
    const rows = (this.#byCode.get(code) ?? []).filter((row) => row.char1);
    return [...Map.groupBy(rows, (row) => row.char1)].map(([value, group]) => ({
      value,
      label: shared(group.map((row) => detail(row.label))).join(', '),
    }));
  }

  /** Second letters that the code allows after the first. */
  secondChars(code, char1) {
    const rows = (this.#byCode.get(code) ?? []).filter(
      (row) => row.char2 && row.char1 === (char1 ?? ''),
    );
    const known = shared(rows.map((row) => detail(row.label))).length;
    return rows.map((row) => ({
      value: row.char2,
      label: detail(row.label).slice(rows.length > 1 ? known : 0).join(', ') || 'not specified',
    }));
  }

  /**
   * Rows that hold every word of the text in code or label; main codes come first.
   * @returns {{code, char1, char2, label}[]}
   */
  search(text, limit = 40) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    const found = [];
    for (const [code, rows] of this.#byCode) {
      const main = { code, char1: '', char2: '', label: title(rows[0].label) };
      if (matches(main, words)) found.push(main);
    }
    if (words.length) {
      for (const row of this.#rows) {
        if (found.length >= limit) break;
        if ((row.char1 || row.char2) && matches(row, words)) found.push(row);
      }
    }
    return found.slice(0, limit);
  }
}

const title = (label) => label.split(':')[0];

const detail = (label) => (label.split(': ')[1] ?? label).split(', ');

/** Leading parts that all lists have in common; one list alone is all common. */
function shared(lists) {
  const [first = [], ...others] = lists;
  const end = first.findIndex((part, i) => others.some((list) => list[i] !== part));
  return end < 0 ? first : first.slice(0, end);
}

function matches(row, words) {
  const text = `${row.code} ${row.code}${row.char1}${row.char2} ${row.label}`.toLowerCase();
  return words.every((word) => text.includes(word));
}
