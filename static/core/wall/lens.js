/**
 * The focal length in px of the picture's width from what people know of a lens. Angles are in degrees. The lens
 * looks through the middle of the picture.
 */

/** @typedef {{width: number, height: number, pixel_aspect?: number}} Size of the picture, in px */

const RADIANS = Math.PI / 180;

/**
 * Returns the length in px on which an angle of view is seen. @param {'horizontal'|'diagonal'} across
 * @param {Size} size
 */
const pixelsOf = (across, { width, height, pixel_aspect: aspect = 1 }) =>
  across === 'diagonal' ? Math.hypot(width, height / aspect) : width;

/**
 * Returns the focal length in px of the picture's height.
 * @param {number} focal in px of its width
 * @param {number} [aspect] width of a pixel by its height
 */
export const focalDown = (focal, aspect = 1) => Number((focal * aspect).toFixed(2));

/**
 * Returns the focal length in px of an angle of view, NaN if no such lens can be.
 * A pinhole sees f tan(angle) from the middle, a fisheye f angle.
 * @param {number} angle
 * @param {'horizontal'|'diagonal'} across
 * @param {Size & {model?: string}} camera
 */
export function focalOfAngle(angle, across, camera) {
  const half = (angle / 2) * RADIANS;
  const isPossible = half > 0 && (camera.model === 'fisheye' || half < Math.PI / 2);
  return isPossible ? pixelsOf(across, camera) / 2 / (camera.model === 'fisheye' ? half : Math.tan(half)) : NaN;
}

/**
 * Returns the angle of view of a focal length in px: the inverse of `focalOfAngle`.
 * @param {number} focal
 * @param {'horizontal'|'diagonal'} across
 * @param {Size & {model?: string}} camera
 */
export function angleOfFocal(focal, across, camera) {
  const ratio = pixelsOf(across, camera) / 2 / focal;
  return (2 * (camera.model === 'fisheye' ? ratio : Math.atan(ratio))) / RADIANS;
}

/**
 * Returns the focal length in px of a lens in mm before a sensor whose width, in mm, fills the picture.
 * @param {number} focalMm
 * @param {number} sensorMm
 * @param {Size} size
 */
export const focalOfSensor = (focalMm, sensorMm, { width }) => (focalMm / sensorMm) * width;

/**
 * Returns the camera's values for a picture of another size and the same shape, from the same lens.
 * @param {Size & {fx: number, fy: number, cx: number, cy: number, skew?: number}} camera
 * @param {number} width
 * @param {number} height
 */
export function resized(camera, width, height) {
  const scale = width / camera.width;
  /** @param {number} centre */
  const to = (centre) => (centre + 0.5) * scale - 0.5; // pixel centres are at integers
  return {
    width,
    height,
    fx: camera.fx * scale,
    fy: camera.fy * scale,
    cx: to(camera.cx),
    cy: to(camera.cy),
    ...(camera.skew && { skew: camera.skew * scale }),
  };
}
