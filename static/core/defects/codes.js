/** The code catalogue: search, labels, and which details a code needs. */

import { get } from '../server/api.js';
import { language, t } from '../page/words.js';

/**
 * @typedef {object} Found
 * @property {string} letters code and characters without a gap, 'BABAA'
 * @property {string} words labels in every language, in small letters
 * @property {boolean} [isOffered] whether a new tag may need it
 *
 * @typedef {Pick<Api['CodeOut'], 'code'|'char1'|'char2'|'label'> & Found} CodeRow a code, or a main code without characters
 * @typedef {Api['CodeOut'] & Found} FullRow
 */

export class Catalogue {
  #rows;
  #byCode;
  /** @type {CodeRow[]|null} */
  #offered = null;

  /**
   * @param {AbortSignal} [signal]
   * @param {string|null} [pack] id of an imported code pack; the built-in one without
   */
  static async load(signal, pack = null) {
    /** @type {Api['CodeOut'][]} */
    const rows = await get(pack ? `/api/codes?pack=${encodeURIComponent(pack)}` : '/api/codes', signal);
    return new Catalogue(
      rows.map((row) => ({
        ...row,
        label: labelOf(row),
        letters: `${row.code}${row.char1}${row.char2}`.toUpperCase(),
        words: [row.label, ...Object.values(row.labels)].join(' | ').toLowerCase(),
        // Y means "not stated" in converted data; nobody who sees the wall needs it.
        isOffered: pack !== null || ![row.char1, row.char2].some((char) => /^Y/.test(char)),
      })),
      pack ?? null,
    );
  }

  /** @param {FullRow[]} rows @param {string|null} [pack] its id; null: the built-in one */
  constructor(rows, pack = null) {
    this.pack = pack;
    this.#rows = rows;
    this.#byCode = Map.groupBy(rows, (row) => row.code);
  }

  /** Main codes, and the full codes that a new tag may need. @returns {CodeRow[]} */
  get rows() {
    this.#offered ??= [
      ...[...this.#byCode.keys()].map((code) => this.#mainOf(code)),
      ...this.#rows.filter((row) => row.isOffered && (row.char1 || row.char2)),
    ];
    return this.#offered;
  }

  /** @param {string} code */
  has(code) {
    return this.#byCode.has(code);
  }

  /**
   * Returns the row of a full code, or the first row of its main code.
   * @param {string|null|undefined} code
   * @param {string|null} [char1]
   * @param {string|null} [char2]
   */
  row(code, char1, char2) {
    const rows = this.#byCode.get(code);
    return (
      rows?.find((row) => row.char1 === (char1 ?? '') && row.char2 === (char2 ?? '')) ??
      rows?.find((row) => row.char1 === (char1 ?? '')) ??
      rows?.[0] ??
      null
    );
  }

  /**
   * Returns the label of the code, as far as its characters are known.
   * @param {string|null|undefined} code
   * @param {string|null} [char1]
   * @param {string|null} [char2]
   */
  label(code, char1, char2) {
    const rows = this.#byCode.get(code);
    if (!rows) return code ? t('code.unknown') : t('code.none');
    const exact = rows.find((row) => row.char1 === (char1 ?? '') && row.char2 === (char2 ?? ''));
    return exact?.label ?? title(rows[0].label);
  }

  /**
   * Returns the first characters that the code allows: [{value, label}]; those of `kept` stay among them.
   * @param {string} code
   * @param {string|null} [kept]
   */
  firstChars(code, kept = null) {
    const rows = (this.#byCode.get(code) ?? []).filter((row) => row.char1 && (row.isOffered || row.char1 === kept));
    return [...Map.groupBy(rows, (row) => row.char1)].map(([value, group]) => ({
      value,
      label: shared(group.map((row) => detail(row.label))).join(', '),
    }));
  }

  /**
   * Returns the second characters that the code allows after the first.
   * @param {string} code
   * @param {string|null} char1
   * @param {string|null} [kept]
   */
  secondChars(code, char1, kept = null) {
    const rows = (this.#byCode.get(code) ?? []).filter(
      (row) => row.char2 && row.char1 === (char1 ?? '') && (row.isOffered || row.char2 === kept),
    );
    const known = shared(rows.map((row) => detail(row.label))).length;
    return rows.map((row) => ({
      value: row.char2,
      label:
        detail(row.label)
          .slice(rows.length > 1 ? known : 0)
          .join(', ') || t('code.not_specified'),
    }));
  }

  /**
   * Returns what an observation lacks before it can be reported: 'code', or some of 'char1', 'char2',
   * 'clock', 'quant1', 'quant2', 'remark'. The server's checks have the same rule.
   * @param {import('./observations.js').Observation} item
   */
  missing(item) {
    const { code, char1, char2, clock, clock_from: clockFrom, continuous, remark } = item;
    if (!code) return ['code'];
    const rows = this.#byCode.get(code);
    if (!rows) return ['code'];
    const lacks = [];
    const follows = rows.filter((row) => row.char1 === (char1 ?? ''));
    if (!char1 && !follows.length) lacks.push('char1');
    else if (!char2 && follows.length && !follows.some((row) => !row.char2)) lacks.push('char2');
    if ([char1, char2].includes('Z') && !remark) lacks.push('remark');
    if (continuous?.startsWith('B')) return lacks; // the finish repeats its start
    const rules = this.row(code, char1, char2);
    if (rules.needs_clock === 'yes' && !(clockFrom ?? clock)) lacks.push('clock');
    if (rules.needs_q1 === 'yes' && (item.quant1 ?? null) === null) lacks.push('quant1');
    if (rules.needs_q2 === 'yes' && (item.quant2 ?? null) === null) lacks.push('quant2');
    return lacks;
  }

  get isBuiltIn() {
    return this.pack === null;
  }

  /** Returns the row that the pack gives to a key. @param {string} key */
  keyed(key) {
    return this.#rows.find((row) => row.hotkey === key) ?? null;
  }

  /**
   * Returns the grade that the pack declares for an observation, 0 below all thresholds; null without one. Reports have
   * the same rule.
   * @param {Partial<import('./observations.js').Observation>} item
   */
  grade({ code, char1, char2, quant1 = null, quant2 = null }) {
    const letters = `${code ?? ''}${char1 ?? ''}${char2 ?? ''}`;
    const row = this.#rows.find((one) => one.letters === letters && one.code === code);
    if (!row) return null;
    if (!row.grade_by) return row.grade_s ?? row.grade_o;
    const size = row.grade_by === 'q1' ? quant1 : quant2;
    if (size === null) return null;
    return row.grades.findLastIndex((from) => from !== null && size >= from) + 1;
  }

  /** Returns the row of a typed code with its characters, 'bab b a' or 'BABBA', or null. @param {string} text */
  typed(text) {
    const letters = lettersOf(text);
    if (this.has(letters)) return this.#mainOf(letters);
    return this.#rows.find((row) => row.letters === letters) ?? null;
  }

  /**
   * Returns rows that begin with the letters of the text, then those that contain every word of it in code
   * or label, in any language; main codes come first.
   * @returns {CodeRow[]}
   * @param {string} text
   * @param {number} [limit]
   */
  search(text, limit = 40) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    if (words.length === 0) return this.rows.slice(0, Math.min(limit, this.#byCode.size));
    const letters = lettersOf(text);
    const found = [
      ...this.rows.filter((row) => row.letters.startsWith(letters)),
      ...this.rows.filter((row) => holds(row, words)),
    ];
    return [...new Map(found.map((row) => [row.letters, row])).values()].slice(0, limit);
  }

  /** Returns a code without its characters. @param {string} code @returns {CodeRow} */
  #mainOf(code) {
    const rows = this.#byCode.get(code);
    const { label, words } = rows[0];
    const titles = words.split(' | ').map(title);
    return { code, char1: '', char2: '', label: title(label), letters: code, words: titles.join(' ') };
  }
}

/**
 * Returns the label of a code in the language of the page, else in that of its pack, which may have no other.
 * @param {{label: string, labels: Record<string, string>}} row
 */
export const labelOf = ({ label, labels }) => labels[language] ?? label;

/** Returns what a row gives to an observation. @param {Pick<CodeRow, 'code'|'char1'|'char2'>} row */
export const codeOf = ({ code, char1, char2 }) => ({ code, char1: char1 || null, char2: char2 || null });

/** @param {string} label */
const title = (label) => label.split(':')[0];

/** @param {string} label */
const detail = (label) => (label.split(': ')[1] ?? label).split(', ');

/** Returns the leading parts common to all lists; those of a single list are all of it. @param {string[][]} lists */
function shared(lists) {
  const [first = [], ...others] = lists;
  const end = first.findIndex((part, i) => others.some((list) => list[i] !== part));
  return end < 0 ? first : first.slice(0, end);
}

/** @param {string} text */
const lettersOf = (text) => text.replace(/[\s.,-]+/g, '').toUpperCase();

/** @param {CodeRow} row @param {string[]} words */
const holds = (row, words) => {
  const text = `${row.letters.toLowerCase()} ${row.words}`;
  return words.every((word) => text.includes(word));
};
