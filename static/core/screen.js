/** Sizes of the screen, for what is drawn on canvases. */

/** How much larger than usual the type of the page is: 1 at a root font of 16 px. */
export const typeScale = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;

/**
 * Makes a canvas as sharp as the screen and clears it.
 * @param {HTMLCanvasElement} canvas filled by CSS
 * @param {number} scale how many CSS px one unit of the drawing is
 * @returns {CanvasRenderingContext2D}
 */
export function sharpContext(canvas, scale) {
  canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
  canvas.height = Math.round(canvas.clientHeight * devicePixelRatio);
  const context = canvas.getContext('2d');
  context.scale(devicePixelRatio * scale, devicePixelRatio * scale);
  return context;
}
