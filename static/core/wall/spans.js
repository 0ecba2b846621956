/**
 * Whether a distance lies within a part of the pipe. Ends are compared up to ROUNDING_MM, as app/survey/places/spans.py does more coarsely:
 * 1000 * 16.1 is more than 16100 in binary.
 */

/** Half of the last digit of a distance that is sent: tracks have a tenth of a millimetre. */
export const ROUNDING_MM = 0.05;

/**
 * Returns whether a distance lies in a range, its ends included.
 * @param {number} mm
 * @param {{low: number, high: number}} range
 */
export const isWithin = (mm, { low, high }) => mm >= low - ROUNDING_MM && mm <= high + ROUNDING_MM;
