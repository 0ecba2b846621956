/** Common drawing of both strips: read-out plates, the play head, the cursor. */

const PLATE_PX = 20;

/**
 * Draws text on a dark plate, kept within the strip.
 * @param {CanvasRenderingContext2D} context
 * @param {CSSStyleDeclaration} styles
 * @param {string} text
 * @param {number} x of its middle
 * @param {number} y of its middle
 * @param {[number, number]} within least and greatest x
 */
export function paintPlate(context, styles, text, x, y, [least, most]) {
  context.font = `600 12px ${styles.getPropertyValue('--sans')}`;
  const width = context.measureText(text).width + 14;
  const left = Math.max(least, Math.min(x - width / 2, most - width));
  context.fillStyle = 'rgb(8 10 12 / 86%)';
  context.beginPath();
  context.roundRect(left, y - PLATE_PX / 2, width, PLATE_PX, 5);
  context.fill();
  context.fillStyle = '#ffffff';
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  context.fillText(text, left + 7, y + 0.5);
}

/**
 * Draws a line across the strip at the play head; an arrow at the edge when it is out of sight.
 * @param {string} halo colour around the line
 */
export function paintPlayhead(context, colour, halo, plot, mm, top, bottom) {
  const x = plot.toX(mm);
  if (x >= plot.left - 1 && x <= plot.right + 1) {
    context.fillStyle = halo;
    context.fillRect(x - 2, top, 4, bottom - top);
    context.fillStyle = colour;
    context.fillRect(x - 1, top, 2, bottom - top);
    return;
  }
  context.fillStyle = colour;
  const [edge, out] = x < plot.left ? [plot.left + 9, -8] : [plot.right - 9, 8];
  const middle = (top + bottom) / 2;
  context.beginPath();
  context.moveTo(edge, middle - 7);
  context.lineTo(edge + out, middle);
  context.lineTo(edge, middle + 7);
  context.fill();
}

/** Draws a thin line under the pointer. */
export function paintHair(context, styles, x, top, bottom) {
  context.strokeStyle = styles.getPropertyValue('--accent');
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(Math.round(x) + 0.5, top);
  context.lineTo(Math.round(x) + 0.5, bottom);
  context.stroke();
}
