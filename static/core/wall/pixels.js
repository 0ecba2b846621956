/**
 * Films whose pixels are not square. Positions are in pixels of the film; people see pictures with square pixels,
 * and so are photos.
 */

/**
 * @typedef {object} Video
 * @property {number} width of the film in px
 * @property {number} height
 * @property {number} [pixel_aspect] width of a pixel by its height
 */

/**
 * Returns how many square pixels a pixel is wide and high; no detail is lost. @param {Video} video
 * @returns {[number, number]}
 */
export const stretchOf = ({ pixel_aspect: aspect = 1 }) => [Math.max(aspect, 1), Math.max(1 / aspect, 1)];

/** Returns the picture with square pixels. @param {Video} video */
export function squareOf(video) {
  const [across, down] = stretchOf(video);
  return { width: Math.round(video.width * across), height: Math.round(video.height * down) };
}

/**
 * Returns where a pixel of the film is in the picture with square pixels; pixel centres are at integers.
 * @param {Video} video
 * @param {[number, number]} pixel
 */
export function toSquare(video, [u, v]) {
  const [across, down] = stretchOf(video);
  return [(u + 0.5) * across - 0.5, (v + 0.5) * down - 0.5];
}
