/** What the overlay of the film draws: the middle, the ring of the selected mark, labels. */

/** Size of a mark, in units of the type. */
export const MARK_PX = 22;

export function paintCentre(context, [x, y]) {
  for (const [width, colour] of [
    [3, 'rgb(0 0 0 / 55%)'],
    [1.2, 'rgb(255 255 255 / 85%)'],
  ]) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.beginPath();
    for (const [dx, dy] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      context.moveTo(x + 6 * dx, y + 6 * dy);
      context.lineTo(x + 16 * dx, y + 16 * dy);
    }
    context.stroke();
  }
}

/** Returns the cell of a raster that contains a point. */
export const placeOf = ([x, y], across, down) => `${Math.round(x / across)} ${Math.round(y / down)}`;

export function paintRing(context, x, y, styles) {
  context.lineWidth = 2.5;
  context.strokeStyle = styles.getPropertyValue('--accent');
  context.beginPath();
  context.arc(x, y, MARK_PX / 2 + 6, 0, 2 * Math.PI);
  context.stroke();
}

/** Draws text on a dark plate, kept within the picture. */
export function paintLabel(context, text, x, y, layout, styles) {
  context.font = `600 15px ${styles.getPropertyValue('--sans')}`;
  const width = context.measureText(text).width + 14;
  const right = layout.left + layout.width * layout.scale;
  const left = Math.min(Math.max(x - width / 2, layout.left + 2), right - width - 2);
  const middle = Math.max(y, layout.top + 14);
  context.fillStyle = 'rgb(8 10 12 / 82%)';
  context.beginPath();
  context.roundRect(left, middle - 12, width, 24, 5);
  context.fill();
  context.fillStyle = '#ffffff';
  context.textBaseline = 'middle';
  context.fillText(text, left + 7, middle + 1);
}
