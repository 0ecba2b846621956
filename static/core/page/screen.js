/** Sizes of the screen, for drawing on canvases. */

/** Ratio of the page's type size to the usual one: 1 at a root font of 16 px. */
export const typeScale = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;

const THEMES = ['(prefers-color-scheme: light)', '(prefers-contrast: more)', '(forced-colors: active)'];

/**
 * Calls `run` when the device changes colours: canvases must be painted again, CSS adapts by itself.
 * @param {() => void} run
 * @param {AbortSignal} signal
 */
export function onThemeChange(run, signal) {
  for (const query of THEMES) matchMedia(query).addEventListener('change', run, { signal });
}

/**
 * Matches a canvas to the resolution of the screen and clears it.
 * @param {HTMLCanvasElement} canvas filled by CSS
 * @param {number} scale CSS px in one unit of the drawing
 * @returns {CanvasRenderingContext2D}
 */
export function sharpContext(canvas, scale) {
  const width = Math.round(canvas.clientWidth * devicePixelRatio);
  const height = Math.round(canvas.clientHeight * devicePixelRatio);
  const context = canvas.getContext('2d');
  // A new size allocates a new bitmap, which is too slow at thirty pictures a second.
  if (canvas.width === width && canvas.height === height) context.reset();
  else [canvas.width, canvas.height] = [width, height];
  context.scale(devicePixelRatio * scale, devicePixelRatio * scale);
  return context;
}
