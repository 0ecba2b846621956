/**
 * Whether a distance lies within a part of the pipe. Ends are compared up to SAME_MM, as in app/survey/spans.py:
 * 1000 * 16.1 is more than 16100 in binary.
 */

/** Distances less than this apart are the same: tracks are sent to a tenth of a millimetre. */
export const SAME_MM = 0.05;

/**
 * Returns whether a distance lies in a range, its ends included.
 * @param {number} mm
 * @param {{low: number, high: number}} range
 */
export const isWithin = (mm, { low, high }) => mm >= low - SAME_MM && mm <= high + SAME_MM;
