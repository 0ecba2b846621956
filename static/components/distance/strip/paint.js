/** Common drawing of the strips: marks, stretches, numbers of joints, plates, play head, cursor. */

import { Plot, ticks } from '../../../core/wall/axis.js';
import { isWithin } from '../../../core/wall/spans.js';
import { drawSeverity } from '../../shared/severity-mark/severity-mark.js';

const PLATE_PX = 20;
const TICK_PX = 72;
const MINOR_TICKS = 5;

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

/** Draws the mark of an observation, with a ring around the selected one. @param {number} size of the mark */
export function paintMark(context, styles, { severity }, x, y, size, isSelected) {
  if (isSelected) {
    context.strokeStyle = styles.getPropertyValue('--accent');
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(x, y, size / 2 + 3.5, 0, 2 * Math.PI);
    context.stroke();
    context.lineWidth = 1;
  }
  drawSeverity(context, severity, x, y, size, styles);
}

/**
 * Draws a bar from the start of a stretch to its end; an open end is frayed: recognisable without colour.
 * @param {import('../../../core/defects/stretches.js').Stretch} stretch
 * @param {number} top
 * @param {number} height
 * @param {string} ground colour that shows between the frays
 * @param {string} outline colour
 */
export function paintStretch(context, styles, plot, stretch, top, height, ground, outline = 'transparent') {
  const [from, to] = [stretch.from_m, stretch.to_m].map((m) => plot.toX(m * 1000));
  context.fillStyle = styles.getPropertyValue(`--severity-${stretch.severity ?? 'none'}`);
  context.beginPath();
  context.roundRect(from, top, Math.max(2, to - from), height, height / 2);
  context.fill();
  context.strokeStyle = outline;
  context.stroke();
  if (!stretch.isOpen) return;
  context.fillStyle = ground;
  for (let x = to - 3; x > Math.max(from, to - 20); x -= 6) context.fillRect(x, top, 2.5, height);
}

/** Draws the axis of a strip: round distances with their texts below, and small ticks between them. */
export function paintAxis(context, colour, plot, range, top) {
  const marks = ticks(range, TICK_PX * plot.mmPerUnit);
  const step = marks.length > 1 ? marks[1].mm - marks[0].mm : 0;
  context.strokeStyle = colour('--line-strong');
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(plot.left, top + 0.5);
  context.lineTo(plot.right, top + 0.5);
  const tick = (mm, size) => {
    if (!isWithin(mm, range)) return;
    const x = Math.round(plot.toX(mm)) + 0.5;
    context.moveTo(x, top);
    context.lineTo(x, top + size);
  };
  for (const { mm } of marks) tick(mm, 6);
  if (step) {
    for (let mm = marks[0].mm - step; mm < range.high; mm += step / MINOR_TICKS) tick(mm, 3);
  }
  context.stroke();
  context.fillStyle = colour('--text-dim');
  context.font = `500 12px ${colour('--sans')}`;
  context.textAlign = 'center';
  context.textBaseline = 'alphabetic';
  for (const { mm, text } of marks) {
    const half = context.measureText(text).width / 2;
    context.fillText(text, Math.min(plot.toX(mm), plot.right + Plot.RIGHT - half - 2), top + 18);
  }
}

/** Returns the step between numbered joints, `atLeast` units of the drawing apart. */
export function numberEvery(joints, plot, atLeast) {
  if (joints.length < 2) return 1;
  const unitM = (joints.at(-1).distance_m - joints[0].distance_m) / (joints.length - 1);
  const apart = (unitM * 1000) / plot.mmPerUnit;
  return [1, 2, 5, 10, 20, 50, 100, 200, 500].find((step) => step * apart >= atLeast) ?? 1000;
}
