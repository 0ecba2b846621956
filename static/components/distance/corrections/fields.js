/** Fields for lengths and their uncertainties, in the person's units. */

import { html } from '../../../core/page/html.js';
import { rounded } from '../../../core/wall/rounding.js';
import { lengthUnit, parseDistance, toShown } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/** The server stores a tenth of a millimetre; a hundredth of a foot is accurate enough. */
const DECIMALS = lengthUnit === 'ft' ? 2 : 3;

/**
 * A labelled field for one number; its input is the part `part`, its fault `<part>Fault`.
 * @param {{part: string, id: string, label: string, unit: string, help?: string}} field
 */
export const numberField = ({ part, id, label, unit, help }) => html`<div class="field">
  <label for="${id}">${label}</label>
  <span class="input-with-unit"><input class="input" id="${id}" inputmode="decimal" autocomplete="off" maxlength="20"
    aria-describedby="${id}-fault${help && ` ${id}-help`}" data-part="${part}" /><span class="unit">${unit}</span></span>
  ${help && html`<span class="help" id="${id}-help">${help}</span>`}
  <span class="fault" id="${id}-fault" data-part="${part}Fault"></span></div>`;

export const metresField = (field) => numberField({ ...field, unit: lengthUnit });

/** Shows a number, unless the person is typing in the field. */
export function write(input, value) {
  if (input !== document.activeElement) input.value = value === null ? '' : String(value);
}

export const writeMetres = (input, m) => write(input, m === null ? null : rounded(toShown(m), DECIMALS));

/**
 * Returns the number in a field, null when it is empty, undefined (with a fault beside it) when it is
 * invalid.
 * @param {Record<string, HTMLElement>} parts
 * @param {string} part
 * @param {(number: number) => boolean} allows
 * @param {string} fault
 */
export function read(parts, part, allows, fault) {
  return checked(parts, part, allows, fault, (text) => Number(text.replace(',', '.').replace('−', '-')));
}

/** Like `read`, for a length in metres. */
export function readMetres(parts, part, allows, fault) {
  return checked(parts, part, allows, fault, (text) => parseDistance(text) ?? NaN);
}

function checked(parts, part, allows, fault, parse) {
  const text = parts[part].value.trim();
  const number = text === '' ? null : parse(text);
  const isFine = number === null || (Number.isFinite(number) && allows(number));
  parts[part].setAttribute('aria-invalid', String(!isFine));
  parts[`${part}Fault`].textContent = isFine ? '' : fault;
  return isFine ? number : undefined;
}

export const isPositive = (number) => number > 0;
export const isNotNegative = (number) => number >= 0;
export const isAny = () => true;

/** 'Frame 12 · 3.42 m', as far as it is tracked. */
export const placeText = (frame, distance) =>
  distance === null ? t('corrections.frame', { frame }) : t('corrections.frame_at', { frame, where: distance });
