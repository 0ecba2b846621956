/**
 * The words of the page, from one catalogue for each language: `words/en.json` and whatever else is beside
 * it, with the same keys. A value is a sentence with {placeholders}, or {one, other} where the count `n`
 * decides. Other modules run after the catalogue has arrived, so that the first paint has the right
 * language.
 */

import { preferences } from './preferences.js';

/** [code, own name] of each language that the server has words of; it names them in the head of the page. */
export const LANGUAGES = [
  .../** @type {NodeListOf<HTMLLinkElement>} */ (document.querySelectorAll('link[hreflang]')),
].map(({ hreflang, title }) => [hreflang, title]);

/** @param {string|null} code */
const isOffered = (code) => LANGUAGES.some(([offered]) => offered === code);

/** Code of the language of the page: the chosen one, else the first of the browser's that there is. */
export const language =
  [preferences.value.language, ...navigator.languages.map((tag) => tag.toLowerCase().split('-')[0])].find(isOffered) ??
  'en';

const { default: catalogue } = await import(`../../words/${language}.json`, {
  with: { type: 'json' },
});
const plurals = new Intl.PluralRules(language);

document.documentElement.lang = language;

/** Returns the value at 'area.name', or undefined. @param {string} key @returns {any} */
const entry = (key) => key.split('.').reduce((area, name) => area?.[name], catalogue);

/**
 * @param {string} key
 * @param {Record<string, any>} values
 * @returns {string}
 */
function sentence(key, values) {
  const found = entry(key);
  const text = found?.other ? (found[plurals.select(values.n)] ?? found.other) : found;
  if (typeof text !== 'string') throw new Error(`No words for ${key}.`);
  return text;
}

/**
 * Returns a sentence as a list for html`...`, where a value may be markup: pieces('x', {key:
 * html`<kbd>T</kbd>`}).
 * @param {string} key
 * @param {Record<string, unknown>} [values]
 */
export function pieces(key, values = {}) {
  return sentence(key, values)
    .split(/\{(\w+)\}/)
    .map((piece, i) => {
      if (i % 2 === 0) return piece;
      if (values[piece] === undefined) throw new Error(`${key} needs {${piece}}.`);
      return values[piece];
    });
}

/**
 * Returns a sentence: t('desk.waiting', {n: 3}). Keys are literal in the source, so that a test can compare
 * them with the catalogues.
 * @param {string} key
 * @param {Record<string, string|number>} [values]
 */
export const t = (key, values) => pieces(key, values).join('');

/** Languages that write nouns with a capital letter also within a sentence. */
const WITH_CAPITALS = ['de', 'lb'];

/**
 * Returns a word that stands alone elsewhere, such as a label, as it is written within a sentence.
 * @param {string} word
 */
export const withinSentence = (word) => (WITH_CAPITALS.includes(language) ? word : word.toLowerCase());

/**
 * Returns the word for a name from the server, wordFor('status', 'done'), or its sentence,
 * wordFor('notice', code, params); null where there is none.
 * @param {string} area
 * @param {string} name
 * @param {Record<string, any>|null} [values] those of its placeholders, among others
 */
export function wordFor(area, name, values = null) {
  const found = entry(area)?.[name];
  if (values && found) return t(`${area}.${name}`, values);
  return typeof found === 'string' ? found : null;
}

/** Errors whose sentence from the server says more than ours: it names the field, the file, the number. */
const WORDED_BY_THE_SERVER = new Set([
  'invalid_request',
  'invalid_rig',
  'rig_video_mismatch',
  'unreadable_video',
  'invalid_pack',
  'invalid_detector',
  'invalid_correction',
  'invalid_message',
  'shape_mismatch',
  'open_stretches',
  'live_source_refused',
  'not_ready',
  'unknown_host',
  'sample_failed',
  'camera_unreachable',
  'export_not_available',
  'feature_not_found',
  'invalid_query',
  'invalid_table',
  'no_such_film',
  'film_missing',
  'film_changed',
  'no_rule',
  'no_rig',
  'rig_missing',
  'invalid_header',
]);

/**
 * Returns why something failed, in the language of the page where the page has a sentence for it.
 * @param {{code: string, message?: string, detail?: string}} error an ApiError, or an error of the API
 */
export function errorText({ code, message, detail }) {
  const sentence = detail ?? message;
  const ours = WORDED_BY_THE_SERVER.has(code) ? null : wordFor('error', code ?? '');
  return ours?.replace('{detail}', () => sentence) ?? sentence;
}
