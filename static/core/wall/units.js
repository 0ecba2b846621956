/**
 * Numbers as people read them, in their units and language. Metres, millimetres and seconds come in, text
 * goes out; typed distances are converted to metres.
 */

import { preferences } from '../page/preferences.js';
import { published, rounded, roundedUp } from './rounding.js';
import { language, t } from '../page/words.js';

export const M_PER_FT = 0.3048;

/** 'm' or 'ft': the unit of distances along the culvert. */
export const lengthUnit = preferences.value.units;

const DECIMALS = lengthUnit === 'ft' ? 1 : 2;

/** Converts metres to the shown unit, and back. @param {number} m */
export const toShown = (m) => (lengthUnit === 'ft' ? m / M_PER_FT : m);
/** @param {number} shown */
export const fromShown = (shown) => (lengthUnit === 'ft' ? shown * M_PER_FT : shown);

/** '3.42 m' or '11.2 ft'; the minus sign is a true one. @param {number|null} m */
export const chainage = (m) => `${chainageNumber(m)} ${lengthUnit}`;

/**
 * '3.42', or a dash while the distance is unknown. It is rounded from the published millimetre, so that a
 * track row, a defect at the same place and a report of it read the same.
 * @param {number|null} m
 */
export function chainageNumber(m) {
  if (m === null) return '–';
  return signed(toShown(published(m)), DECIMALS);
}

/** Smallest half-width: distances are shown to a centimetre, and none is known better. */
export const LEAST_M = 0.01;

/**
 * Half of the 95 % interval in metres, as in app/survey/distances/interval.py: rounded up to a millimetre.
 * @param {number} sigmaMm
 */
export const u95FromSigma = (sigmaMm) => Math.max(LEAST_M, roundedUp((1.96 * sigmaMm) / 1000, 3));

/** '± 0.01 m', rounded up to the last digit shown, and never zero. @param {number|null} u95M */
export function plusMinus(u95M) {
  if (u95M === null) return '';
  const shown = Math.max(roundedUp(toShown(u95M), DECIMALS), 10 ** -DECIMALS);
  return `± ${shown.toFixed(DECIMALS)} ${lengthUnit}`;
}

/** '4.2 m/min' or '13.8 ft/min'. @param {number} mPerMin */
export const speed = (mPerMin) => `${signed(toShown(mPerMin), 1)} ${lengthUnit}/min`;

/**
 * Returns the metres of a typed distance, or null when it is invalid: '12.40', '12,40', '40.7 ft',
 * '−1.2 m'. A distance without a unit is in the shown unit.
 * @param {string} text
 */
export function parseDistance(text) {
  const match = /^([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+))\s*(m|ft|')?$/i.exec(text.trim().replace('−', '-'));
  if (!match) return null;
  const number = Number(match[1].replace(',', '.'));
  const unit = match[2]?.toLowerCase() ?? lengthUnit;
  return unit === 'm' ? number : number * M_PER_FT;
}

/** A number with a true minus sign, and none before a zero. @param {number} value @param {number} decimals */
export const signed = (value, decimals) => rounded(value, decimals).toFixed(decimals).replace('-', '−');

/** '+12', '−3', '0'. @param {number} value @param {number} decimals */
export const withSign = (value, decimals) => `${rounded(value, decimals) > 0 ? '+' : ''}${signed(value, decimals)}`;

/** '0:03.42', or '1:02:03.42' above an hour. @param {number} seconds @param {number} [decimals] */
export function timecode(seconds, decimals = 2) {
  const scale = 10 ** decimals;
  const total = Math.round(Math.max(0, seconds) * scale) / scale;
  const hours = Math.floor(total / 3600);
  const minutes = Math.floor((total % 3600) / 60);
  const rest = (total % 60).toFixed(decimals).padStart(decimals ? 3 + decimals : 2, '0');
  return hours ? `${hours}:${String(minutes).padStart(2, '0')}:${rest}` : `${minutes}:${rest}`;
}

/** 'less than 10 s', '40 s', '3 min', '1 h 5 min'. @param {number} seconds */
export function duration(seconds) {
  if (seconds < 10) return t('units.under_10_s');
  if (seconds < 90) return t('units.seconds', { s: Math.round(seconds / 5) * 5 });
  const minutes = Math.round(seconds / 60);
  if (minutes < 60) return t('units.minutes', { min: minutes });
  return t('units.hours', { h: Math.floor(minutes / 60), min: minutes % 60 });
}

const BYTE_UNITS = ['B', 'kB', 'MB', 'GB', 'TB'];

/** '12.3 MB' (decimal units). @param {number} count */
export function bytes(count) {
  const power = Math.min(Math.floor(Math.log10(Math.max(count, 1)) / 3), BYTE_UNITS.length - 1);
  return `${(count / 1000 ** power).toFixed(power ? 1 : 0)} ${BYTE_UNITS[power]}`;
}

/** '6 o’clock': whole hours, as pipe inspectors write them. @param {number} hours */
export const clockHour = (hours) => t('units.clock', { hour: Math.round(hours) % 12 || 12 });

/** '10 to 2 o’clock', or one hour where there is no end. @param {number} from @param {number|null} to */
export const clockRange = (from, to) => (to === null ? clockHour(from) : t('units.clock_sector', { from, to }));

/**
 * English means that of Britain, unless the browser says otherwise: its dates are read in one way only.
 * @type {Record<string, string>}
 */
const REGIONS = { en: 'en-GB' };

/** The regional variant of the chosen language where the browser has one, such as en-US. */
const locale = navigator.languages.find((tag) => tag.startsWith(`${language}-`)) ?? REGIONS[language] ?? language;
const DATE = new Intl.DateTimeFormat(locale, { dateStyle: 'medium', timeStyle: 'short' });

/** Formats an instant of the API in the person's language and time zone. @param {string|Date} at */
export const date = (at) => DATE.format(new Date(at));

const DAY = new Intl.DateTimeFormat(locale, { dateStyle: 'medium', timeZone: 'UTC' });

/** Formats a date without a time: '2019-05-02'. @param {string} iso */
export const day = (iso) => DAY.format(new Date(iso));

const COUNT = new Intl.NumberFormat(locale);

/**
 * '10,000': a number of things. Decimals have a point in every language, as in the reports and exports; so where a
 * language groups digits by a point, a narrow space takes its place.
 * @param {number} n
 */
export const count = (n) => COUNT.format(n).replaceAll('.', '\u202f');
