/** The pipe of an inspection is stated once, in its header; the rig takes it from there. */

/** Which field of the header a field of the rig is. */
export const FIELD_OF = {
  'pipe.shape': 'shape',
  'pipe.diameter_mm': 'height_mm',
  'pipe.segment_length_mm': 'unit_length_m',
};
const SHAPES = { circular: 'circular', rectangular: 'flat' };
const MM = 1000;

/**
 * Returns what a header states of the rig, by path; '' where it is empty. A cross-section that is no circle and has no
 * flat floor leaves open as what the wall is measured.
 * @param {Record<string, any>} header
 */
export function pipeOf({ shape, height_mm: height, unit_length_m: unit }) {
  const isRound = SHAPES[shape] === 'circular';
  return {
    'pipe.segment_length_mm': unit ? Math.round(MM * unit * 10) / 10 : '',
    ...(SHAPES[shape] && { 'pipe.shape': SHAPES[shape] }),
    ...(isRound && { 'pipe.diameter_mm': height ?? '' }),
  };
}

/**
 * Returns what a rig states of the header, by field; undefined where it says nothing.
 * @param {Record<string, any>} values by path
 */
export function headerOf({ 'pipe.shape': shape, 'pipe.diameter_mm': diameter, 'pipe.segment_length_mm': segment }) {
  return {
    shape: Object.keys(SHAPES).find((name) => SHAPES[name] === shape),
    height_mm: Number(diameter) || undefined,
    unit_length_m: Number(segment) / MM || undefined,
  };
}
