/** What measuring draws over the unrolled wall. */

import { t } from '../../../core/page/words.js';
import { paintPlate } from '../../distance/strip/paint.js';
import { paintMeasure, paintScaleBar } from './paint.js';

/** Greatest length of the scale bar. */
const BAR_PX = 140;
/** From the top of the strip to the bar: below stand the names of the joints, and around noon little is seen. */
const TOP_PX = 26;
/** From a measure to the middle of its label. */
const AWAY_PX = 20;

/**
 * Draws measures within the plot of the strip.
 * @param {CanvasRenderingContext2D} context
 * @param {CSSStyleDeclaration} styles
 * @param {{left: number, right: number, width: number}} plot
 * @param {number} height of the strip
 * @param {import('./paint.js').Drawn[]} drawn
 * @param {(point: import('../../../core/wall/measure.js').Point) => [number, number]|null} toPlace
 */
export function paintOnWall(context, styles, plot, height, drawn, toPlace) {
  const label = (text, x, top, bottom) => {
    const y = bottom + 2 * AWAY_PX < height ? bottom + AWAY_PX : top - AWAY_PX;
    paintPlate(context, styles, text, x, y, [plot.left, plot.right]);
  };
  context.save();
  context.beginPath();
  context.rect(plot.left, 0, plot.width, height);
  context.clip();
  // On the strip the measures of one defect lie close together: the newest is labelled.
  const labelled = drawn.findLast(({ isStrong }) => isStrong);
  for (const one of drawn) {
    paintMeasure(context, one, one.measure.points.map(toPlace), one === labelled ? label : () => {});
  }
  context.restore();
}

/** Draws the scale along the pipe; around it the unseen hours are compressed. */
export function paintWallScale(context, styles, plot) {
  const textOf = (size) => t('measure.bar_along', { size });
  /** @type {[number, number]} */
  const at = [plot.right - BAR_PX - 10, TOP_PX];
  paintScaleBar(context, 1 / plot.mmPerUnit, at, BAR_PX, textOf, styles.getPropertyValue('--sans'));
}
