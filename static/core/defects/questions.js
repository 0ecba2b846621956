/** What a code asks about a defect, one question after the other, and what a key answers. */

import { hoursOf, isClock } from './code-chain.js';

/**
 * @typedef {import('./observations.js').Observation} Observation
 * @typedef {import('./observations.js').Fields} Fields
 * @typedef {'char1'|'char2'|'clock'|'quant1'|'quant2'|'severity'|'remark'} QuestionName
 *
 * @typedef {object} Question
 * @property {QuestionName} name
 * @property {boolean} isNeeded whether a report lacks the answer
 * @property {boolean} isOpen whether it is asked by itself: needed, or a defect without its severity
 * @property {{value: string, label: string}[]} [choices] of a character
 *
 * @typedef {object} Answer
 * @property {string} typed what is typed of the answer so far
 * @property {Partial<Fields>|null} changes null: none yet
 * @property {boolean} isDone whether nothing can follow, so that the next question comes
 */

/** Groups of codes that describe no defect: the inventory, and others such as the water level. */
const NO_DEFECTS = ['C', 'M'];

/**
 * Returns the questions of the code that an observation has, in the order in which they are asked.
 * @param {Observation} item
 * @param {import('./codes.js').Catalogue} catalogue
 * @returns {Question[]}
 */
export function questionsOf(item, catalogue) {
  const { code, char1, char2, severity = null } = item;
  const rules = code ? catalogue.row(code, char1, char2) : null;
  if (!rules) return [];
  const lacks = catalogue.missing(item);
  const [first, second] = [catalogue.firstChars(code, char1), catalogue.secondChars(code, char1 ?? null, char2)];
  const isFinish = Boolean(item.continuous?.startsWith('B')); // it repeats its start
  /** @type {[QuestionName, boolean, {value: string, label: string}[]?][]} name, whether it belongs to the code */
  const all = [
    ['char1', first.length > 0, first],
    ['char2', second.length > 0, second],
    ['clock', rules.needs_clock !== 'no' || isStated(item.clock_from, item.clock_to)],
    ['quant1', rules.needs_q1 !== 'no' || isStated(item.quant1)],
    ['quant2', rules.needs_q2 !== 'no' || isStated(item.quant2)],
    ['severity', true],
    ['remark', true],
  ];
  const isUnrated = severity === null && !isFinish && !NO_DEFECTS.includes(rules.group);
  return all
    .filter(([, isThere]) => isThere)
    .map(([name, , choices]) => {
      const isNeeded = lacks.includes(name);
      return { name, isNeeded, isOpen: isNeeded || (name === 'severity' && isUnrated), choices };
    });
}

/** @param {...unknown} values */
const isStated = (...values) => values.some((value) => (value ?? null) !== null);

/**
 * Returns what a key answers to a question; null where it is no key of it.
 * @param {Question} question
 * @param {string} typed so far
 * @param {string} key as KeyboardEvent.key
 * @returns {Answer|null}
 */
export function answerOf({ name, choices }, typed, key) {
  if (choices) return charOf(name, choices, typed, key);
  if (name === 'clock') return clockOf(typed, key);
  if (name === 'severity')
    return /^[0-5]$/.test(key) ? { typed: '', changes: { severity: Number(key) }, isDone: true } : null;
  if (name !== 'quant1' && name !== 'quant2') return null;
  const number = /^[\d.,]$/.test(key) ? numberIn(typed + key) : undefined;
  return number === undefined ? null : { typed: typed + key, changes: { [name]: number }, isDone: false };
}

/**
 * A character may have several letters, such as a material: it is known as soon as only one begins like that.
 * @param {QuestionName} name
 * @param {{value: string}[]} choices
 * @param {string} typed
 * @param {string} key
 * @returns {Answer|null}
 */
function charOf(name, choices, typed, key) {
  const text = typed + key.toUpperCase();
  const fits = choices.filter(({ value }) => value.startsWith(text));
  if (key.length !== 1 || fits.length === 0) return null;
  const found = fits.find(({ value }) => value === text) ?? (fits.length === 1 ? fits[0] : null);
  return { typed: text, changes: found && charChanges(name, found.value), isDone: fits.length === 1 };
}

/**
 * Another first character has other second ones.
 * @param {QuestionName} name
 * @param {string|null} value
 * @returns {Partial<Fields>}
 */
export const charChanges = (name, value) => (name === 'char1' ? { char1: value, char2: null } : { [name]: value });

/**
 * @param {string} typed such as `@10@`
 * @param {string} key
 * @returns {Answer|null}
 */
function clockOf(typed, key) {
  const sign = key === '.' ? '@' : key; // within reach on a number pad
  const text = (typed || sign === '@' ? typed : '@') + sign;
  if (!/^[\d@]$/.test(sign) || !isClock(text)) return null;
  const hours = hoursOf(text);
  const isDone = sign !== '@' && ![...'0123456789'].some((digit) => isClock(text + digit));
  return { typed: text, changes: hours.clock_from === null ? null : hours, isDone };
}

/**
 * Returns the number of a text, null when it is empty, undefined when it is not allowed.
 * @param {string} text
 */
export function numberIn(text) {
  if (text.trim() === '') return null;
  const number = Number(text.trim().replace(',', '.'));
  return Number.isFinite(number) && number >= 0 ? number : undefined;
}

/**
 * Returns the question that is asked next: the first open one that was not passed over.
 * @param {Question[]} questions
 * @param {Set<QuestionName>} [passed]
 */
export const nextOpen = (questions, passed = new Set()) =>
  questions.find(({ name, isOpen }) => isOpen && !passed.has(name)) ?? null;
