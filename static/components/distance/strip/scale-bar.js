/** A scale bar on a canvas, and what else must be legible on any ground: a wide halo below thin ink. */

/** @typedef {{ink: string, halo: string, font: string}} Look colours, and a font family */

/**
 * Draws lines on a halo.
 * @param {CanvasRenderingContext2D} context
 * @param {Look} look
 * @param {() => void} trace makes the path
 */
export function strokeOnHalo(context, { ink, halo }, trace) {
  for (const [width, colour] of /** @type {const} */ ([
    [5, halo],
    [2, ink],
  ])) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.beginPath();
    trace();
    context.stroke();
  }
}

/** Writes text on a halo; (x, y) is its lower left corner. */
export function textOnHalo(context, { ink, halo, font }, text, x, y) {
  context.font = `600 12px ${font}`;
  context.textAlign = 'left';
  context.textBaseline = 'bottom';
  context.lineWidth = 3;
  context.strokeStyle = halo;
  context.fillStyle = ink;
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}

/**
 * Draws a bar with its length.
 * @param {CanvasRenderingContext2D} context
 * @param {Look} look
 * @param {[number, number]} at its left end
 * @param {number} long in units of the canvas
 * @param {string} text
 */
export function drawScaleBar(context, look, [x, y], long, text) {
  context.save();
  context.lineCap = 'butt';
  strokeOnHalo(context, look, () => {
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + long, y);
    context.lineTo(x + long, y - 5);
  });
  textOnHalo(context, look, text, x + 4, y - 5);
  context.restore();
}
