/** Sizes of the screen, for what is drawn on canvases. */

/** How much larger than usual the type of the page is: 1 at a root font of 16 px. */
export const typeScale = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;

const THEMES = ['(prefers-color-scheme: light)', '(prefers-contrast: more)', '(forced-colors: active)'];

/**
 * Calls `run` when the device changes colours: canvases must be painted anew, CSS follows by itself.
 * @param {() => void} run
 * @param {AbortSignal} signal
 */
export function onThemeChange(run, signal) {
  for (const query of THEMES) matchMedia(query).addEventListener('change', run, { signal });
}

/**
 * Makes a canvas as sharp as the screen and clears it.
 * @param {HTMLCanvasElement} canvas filled by CSS
 * @param {number} scale how many CSS px one unit of the drawing is
 * @returns {CanvasRenderingContext2D}
 */
export function sharpContext(canvas, scale) {
  const width = Math.round(canvas.clientWidth * devicePixelRatio);
  const height = Math.round(canvas.clientHeight * devicePixelRatio);
  const context = canvas.getContext('2d');
  // A new size makes a new bitmap, which at thirty pictures a second is too dear.
  if (canvas.width === width && canvas.height === height) context.reset();
  else [canvas.width, canvas.height] = [width, height];
  context.scale(devicePixelRatio * scale, devicePixelRatio * scale);
  return context;
}
