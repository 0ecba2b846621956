/**
 * The one way in which a figure is rounded, as app/rounding.py has it: values half away from zero, on
 * their decimal form, intervals up.
 */

/** 12 digits: 0.705 * 100 is 70.4999... in binary, and rounds up on paper. */
const PRECISION = 12;

/** Of a number that is whole but for its binary form. */
const WHOLE = 1e-9;

/** To so many digits behind the point; never -0. */
export function rounded(value, digits) {
  const steps = 10 ** digits;
  const whole = Math.round(Number((Math.abs(value) * steps).toPrecision(PRECISION)));
  return whole ? (Math.sign(value) * whole) / steps : 0;
}

/** To the next step that is not below it. */
export function roundedUp(value, digits) {
  const steps = 10 ** digits;
  return Math.ceil(value * steps - WHOLE) / steps;
}

/** A distance as it is published: to the millimetre, by way of whole tenths, as tracks are sent. */
export const published = (m) => rounded(rounded(m, 4), 3);
