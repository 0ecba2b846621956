/** Fields of a header as inputs: their markup, and values as texts and back. */

import { html } from '../../../core/page/html.js';
import { rounded } from '../../../core/wall/rounding.js';
import { lengthUnit, parseDistance, toShown } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';

/** Fields with several lines. */
const LONG = new Set(['remarks', 'abandon_reason', 'location_text']);

/** Decimals of a length in the field: the API stores a tenth of a millimetre. */
const LENGTH_DECIMALS = lengthUnit === 'ft' ? 2 : 3;

/**
 * @typedef {object} Field
 * @property {string} name
 * @property {'required'|'auto'|'more'} group
 * @property {'text'|'number'|'choice'|'date'|'time'|'bool'} kind
 * @property {string[]} choices
 * @property {string|null} unit
 */

/** Returns the text of a field for a value. */
export function written({ kind, unit }, value) {
  if (value === null) return '';
  if (kind === 'number' && unit === 'm') {
    return String(rounded(toShown(value), LENGTH_DECIMALS));
  }
  return String(value);
}

/** Returns the value of a text: null when it is empty, undefined when it is no number. */
export function read({ kind, unit }, text) {
  const trimmed = text.trim();
  if (trimmed === '') return null;
  if (kind === 'bool') return trimmed === 'true';
  if (kind !== 'number') return trimmed;
  const number = unit === 'm' ? parseDistance(trimmed) : Number(trimmed.replace(',', '.').replace('−', '-'));
  if (number === null || !Number.isFinite(number)) return undefined;
  return unit === 'm' ? rounded(number, 4) : number;
}

/** @param {Field} field */
export function fieldMarkup(field) {
  const { name, unit } = field;
  const id = `header-${name}`;
  const label = wordFor('header', name) ?? name;
  const control = controlMarkup(field, id);
  return html`<div class="field${LONG.has(name) && ' whole-row'}">
    <label for="${id}">${label} <span class="required" aria-hidden="true" hidden>*</span></label>
    ${unit ? html`<span class="input-with-unit">${control}<span class="unit">${unit === 'm' ? lengthUnit : unit}</span></span>` : control}
    <button type="button" class="header-form__proposal" data-proposes="${name}" hidden></button>
    <span class="fault" id="${id}-fault"></span></div>`;
}

/** The choices of a field, and the word for none of them; null where anything may be typed. */
function choicesOf({ name, kind, choices }) {
  if (name === 'code_pack') return { none: t('settings.pack_built_in'), choices: [] }; // they depend on the project
  if (kind === 'choice') {
    return { none: t('header.choose'), choices: choices.map((one) => [one, wordFor('header.choice', one) ?? one]) };
  }
  if (kind !== 'bool') return null;
  return { none: t('page.not_stated'), choices: Object.entries({ true: t('page.yes'), false: t('page.no') }) };
}

function controlMarkup(field, id) {
  const { name, kind } = field;
  const offered = choicesOf(field);
  if (offered) {
    return html`<select class="input" id="${id}" data-field="${name}" aria-describedby="${id}-fault">
    <option value="">${offered.none}</option>
    ${offered.choices.map(([value, text]) => html`<option value="${value}">${text}</option>`)}</select>`;
  }
  if (LONG.has(name)) {
    return html`<textarea class="input" id="${id}" data-field="${name}" rows="2" maxlength="2000"
      aria-describedby="${id}-fault"></textarea>`;
  }
  const type = kind === 'date' || kind === 'time' ? kind : 'text';
  return html`<input class="input" id="${id}" data-field="${name}" type="${type}" maxlength="2000" autocomplete="off"
    inputmode="${kind === 'number' ? 'decimal' : 'text'}" aria-describedby="${id}-fault"
    ${name === 'reference_point' && html`list="header-references"`} />`;
}
