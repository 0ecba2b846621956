/** The rules of the archive in the browser: stored ones, their version, and the place of a fault. */

import { bodyOf, send } from '../server/api.js';

const RULES = '/api/archive/rules';

/** Fetches the rules with their version. @param {AbortSignal} [signal] */
export async function loadRules(signal) {
  return withVersion(await send('GET', RULES, { signal }));
}

/**
 * Replaces the rules, unless somebody else did so after `version`.
 * @param {Api['Rules']} wanted
 * @param {string} version
 */
export async function saveRules({ rigs, rules }, version) {
  const headers = { 'Content-Type': 'application/json', 'If-Match': `"${version}"` };
  return withVersion(await send('PUT', RULES, { headers, body: JSON.stringify({ rigs, rules }) }));
}

/** @param {Response} response @returns {Promise<Required<Api['Rules']> & {version: string}>} */
async function withVersion(response) {
  const version = response.headers.get('ETag')?.replaceAll('"', '');
  return { ...(await bodyOf(response, 'json')), version };
}

/**
 * Splits the server's sentence into its parts and their places: 'rules.2.pattern: … (found 'x'); …'.
 * @returns {{place: string[], text: string}[]} place: e.g. ['rules', '2', 'pattern'], [] where it names none
 * @param {string} sentence
 */
export function faultsIn(sentence) {
  return sentence.split(/; (?=(?:rules|rigs)\.)/).map((part) => {
    const found = /^((?:rules|rigs)\.[^:]*): (.*)$/s.exec(part);
    return found ? { place: found[1].split('.'), text: found[2] } : { place: [], text: part };
  });
}
