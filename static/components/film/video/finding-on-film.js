/** The finding that a person looks at, drawn where the shown picture has it. */

import { outlineOf } from '../../../core/defects/findings.js';
import { clockAt } from '../views/rows.js';
import { paintRing } from './overlay-drawing.js';

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Desk} desk
 * @param {(pixel: number[]) => [number, number]} toStage
 * @param {CSSStyleDeclaration} styles
 */
export function paintFinding(context, { findings, playhead, tab, wall }, toStage, styles) {
  const { row, frame } = playhead.value;
  const { shown } = findings;
  if (tab.value !== 'findings' || !shown || !row) return;
  const { radius } = wall ?? {};
  const seen = outlineOf(shown)
    .map(([mm, arc]) => ({ distance_m: mm / 1000, right_mm: arc, clock_h: radius ? clockAt(arc, radius) : null }))
    .map((point) => wall?.pixel(point, row) ?? null)
    .filter((pixel) => pixel !== null);
  if (frame === shown.frame && shown.pixel) paintRing(context, ...toStage(/** @type {any} */ (shown.pixel)), styles);
  if (seen.length < 2) return;
  context.beginPath();
  for (const pixel of seen) context.lineTo(...toStage(pixel));
  if (shown.kind !== 'crack') context.closePath();
  for (const [width, colour] of /** @type {[number, string][]} */ ([
    [4, 'rgb(8 10 12 / 60%)'],
    [2, '#ffb347'],
  ])) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.setLineDash(width === 2 ? [6, 4] : []);
    context.stroke();
  }
  context.setLineDash([]);
}
