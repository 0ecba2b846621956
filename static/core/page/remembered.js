/** What this browser remembers between pages: JSON by key. Another program, or an older page, may have written it. */

import { person } from './rights.js';

/**
 * Returns the key of what one person alone left here: whoever logs in after them neither sees it nor sends it.
 * @param {string} key
 */
export const ofPerson = (key) => `${key}.of.${person}`;

/**
 * Returns what is remembered; `otherwise` where there is nothing, or nothing of the same kind (a list, an object
 * with members, another value), so that a broken entry never keeps a page from opening.
 * @template T
 * @param {string} key
 * @param {T} otherwise null: any object or null will do
 * @returns {T}
 */
export function recall(key, otherwise) {
  const text = localStorage.getItem(key);
  if (text === null) return otherwise;
  try {
    const value = JSON.parse(text);
    return kindOf(value) === kindOf(otherwise ?? {}) ? value : otherwise;
  } catch (error) {
    if (!(error instanceof SyntaxError)) throw error;
    return otherwise;
  }
}

/**
 * Returns `usual` with the members that are remembered; one of another kind counts as not remembered.
 * @template {Record<string, any>} T
 * @param {string} key
 * @param {T} usual a member that is null may become anything
 * @returns {T}
 */
export function recallMembers(key, usual) {
  /** @param {[string, any]} member */
  const isFit = ([name, value]) => name in usual && (usual[name] === null || kindOf(value) === kindOf(usual[name]));
  return { ...usual, ...Object.fromEntries(Object.entries(recall(key, {})).filter(isFit)) };
}

/**
 * Remembers a value; null forgets it. Returns whether that is so: a browser that is full or stores nothing keeps what
 * it had, and that must never keep the page from going on.
 * @param {string} key
 * @param {unknown} value
 */
export function remember(key, value) {
  try {
    if (value === null) localStorage.removeItem(key);
    else localStorage.setItem(key, JSON.stringify(value));
    return true;
  } catch (error) {
    if (!REFUSALS.includes(error.name)) throw error;
    return false;
  }
}

/** Of a storage that is full, and of one that the browser denies. */
const REFUSALS = ['QuotaExceededError', 'SecurityError'];

/** @param {unknown} value */
const kindOf = (value) => (Array.isArray(value) ? 'list' : value === null ? 'nothing' : typeof value);
