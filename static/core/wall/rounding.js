/**
 * The one way to round a figure, as in app/survey/rounding.py: values half away from zero, on their decimal
 * form, intervals up.
 */

/** 12 digits: 0.705 * 100 is 70.4999... in binary, and rounds up on paper. */
const PRECISION = 12;

/** Tolerance within which a number counts as whole despite its binary form. */
const WHOLE = 1e-9;

/** Rounds to a number of decimals; never returns -0. @param {number} value @param {number} digits */
export function rounded(value, digits) {
  const steps = 10 ** digits;
  const whole = Math.round(Number((Math.abs(value) * steps).toPrecision(PRECISION)));
  return whole ? (Math.sign(value) * whole) / steps : 0;
}

/** Rounds up to the next step. @param {number} value @param {number} digits */
export function roundedUp(value, digits) {
  const steps = 10 ** digits;
  return Math.ceil(value * steps - WHOLE) / steps;
}

/**
 * Rounds a distance for publication: to tenths of a millimetre, as tracks are sent, then to the millimetre.
 * @param {number} m
 */
export const published = (m) => rounded(rounded(m, 4), 3);
