/**
 * The marks of a drawing, painted over its photo: arrows, lines drawn by hand, texts. The server draws the same
 * marks into reports (`app/reports/content/marked_photo.py`).
 */

export const COLOURS = { red: '#ff3b30', yellow: '#ffd60a', white: '#ffffff', blue: '#3ea6ff' };
/** Around every mark, so that it is seen on any wall. */
const EDGE = '#000000';
/** Width of lines and height of letters against the width of the picture, and the least in px. */
const LINE = { share: 1 / 250, least: 2 };
const TEXT = { share: 1 / 28, least: 12 };
/** Length of an arrow's head in widths of its line, and half of its angle. */
const HEAD = { lines: 6, rad: (28 * Math.PI) / 180 };

/**
 * @param {HTMLCanvasElement} canvas over the picture
 * @param {object[]} strokes in pixels of the picture
 * @param {{width: number, height: number}} picture
 * @param {number} [widthPx] of the canvas: so many pixels as the picture has, or fewer for a small one
 */
export function paintStrokes(canvas, strokes, { width, height }, widthPx = width) {
  const scale = widthPx / width;
  const size = { width: widthPx, height: Math.round(height * scale) };
  if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
  const context = canvas.getContext('2d');
  context.clearRect(0, 0, size.width, size.height);
  context.save();
  context.scale(scale, scale);
  context.translate(0.5, 0.5); // pixel centres are integers
  context.lineCap = context.lineJoin = 'round';
  for (const stroke of strokes) paint(context, stroke, (size) => Math.max(size.least / scale, width * size.share));
  context.restore();
}

function paint(context, { kind, points, colour, text }, sizeOf) {
  const line = sizeOf(LINE);
  if (kind === 'text') {
    context.font = `${sizeOf(TEXT)}px "Noto Sans", sans-serif`;
    context.strokeStyle = EDGE;
    context.lineWidth = line;
    context.strokeText(text, ...points[0]);
    context.fillStyle = COLOURS[colour];
    context.fillText(text, ...points[0]);
    return;
  }
  const path = pathThrough(points);
  if (kind === 'arrow' && points.length > 1) path.addPath(headOf(points[0], points[1], line * HEAD.lines));
  for (const [ink, wide] of [
    [EDGE, 2 * line],
    [COLOURS[colour], line],
  ]) {
    context.strokeStyle = ink;
    context.lineWidth = wide;
    context.stroke(path);
  }
}

/** @param {[number, number][]} points */
function pathThrough([first, ...others]) {
  const path = new Path2D();
  path.moveTo(...first);
  path.lineTo(...first); // a single point is a dot
  for (const point of others) path.lineTo(...point);
  return path;
}

function headOf([tailU, tailV], [tipU, tipV], length) {
  const back = Math.atan2(tailV - tipV, tailU - tipU);
  /** @returns {[number, number]} */
  const side = (angle) => [tipU + length * Math.cos(angle), tipV + length * Math.sin(angle)];
  return pathThrough([side(back - HEAD.rad), [tipU, tipV], side(back + HEAD.rad)]);
}
