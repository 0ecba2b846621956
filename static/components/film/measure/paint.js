/** Draws measures on the picture and on the unrolled wall, and the scale bars of both. */

import { KINDS } from '../../../core/wall/measure.js';
import { drawScaleBar } from '../../distance/strip/scale-bar.js';
import { figureText, kindText } from './figures.js';

const HALO = 'rgb(8 10 12 / 75%)';
const STRONG = '#5ff2e0';
const FAINT = 'rgb(95 242 224 / 70%)';
const END_PX = 4;
/** Sizes of a scale bar, mm. */
const NICE_MM = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000];

/**
 * @typedef {object} Drawn
 * @property {import('../../../core/wall/measure.js').Measure} measure
 * @property {string} text '' as long as there is no size
 * @property {boolean} isStrong of the selected defect, or just being measured
 */

/** Returns the stored measures of some observations. @returns {Drawn[]} */
export const storedMeasures = ({ measuring, selection }, observations) =>
  observations.flatMap(({ id, measures, measured }) =>
    (measures ?? []).map((measure, i) => ({
      measure,
      text: `${kindText(measure.kind)} ${figureText(measured?.[i] ?? measuring.sizeOf(measure))}`,
      isStrong: id === selection.value,
    })),
  );

/**
 * Returns the measure that is being made, to the pointer, or nothing.
 * @param {import('./measuring.js').Measuring} measuring
 * @param {import('../../../core/wall/measure.js').Point|null} pointer
 * @returns {Drawn[]}
 */
export function runningMeasure(measuring, pointer) {
  const { value } = measuring;
  if (!value) return [];
  const { kind, figure } = value;
  const isOpen = pointer && value.points.length < KINDS[kind].most;
  const points = isOpen ? [...value.points, pointer] : value.points;
  const size = !isOpen && figure ? figure : measuring.sizeOf({ kind, points });
  return [{ measure: { kind, points }, text: size ? `${kindText(kind)} ${figureText(size)}` : '', isStrong: true }];
}

/**
 * Draws a measure.
 * @param {CanvasRenderingContext2D} context
 * @param {Drawn} drawn
 * @param {([number, number]|null)[]} places of its points; null out of sight
 * @param {(text: string, x: number, top: number, bottom: number) => void} label draws a text above or below what is drawn
 */
export function paintMeasure(context, { measure, text, isStrong }, places, label) {
  const shown = places.filter((place) => place !== null);
  if (shown.length === 0) return;
  context.lineJoin = 'round';
  for (const [width, colour] of /** @type {const} */ ([
    [isStrong ? 5 : 3.5, HALO],
    [isStrong ? 2 : 1.5, isStrong ? STRONG : FAINT],
  ])) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.beginPath();
    shown.forEach(([x, y], i) => context[i ? 'lineTo' : 'moveTo'](x, y));
    if (measure.kind === 'area' && shown.length > 2) context.closePath();
    context.stroke();
    for (const [x, y] of shown) {
      context.beginPath();
      context.arc(x, y, END_PX, 0, 2 * Math.PI);
      context.stroke();
    }
  }
  context.lineWidth = 1;
  if (!isStrong || !text) return;
  const x = shown.reduce((sum, place) => sum + place[0], 0) / shown.length;
  const ys = shown.map((place) => place[1]);
  label(text, x, Math.min(...ys), Math.max(...ys));
}

/**
 * Draws a scale bar with its length.
 * @param {CanvasRenderingContext2D} context
 * @param {number} perMm units of the canvas for one mm
 * @param {[number, number]} at left end
 * @param {number} atMost greatest length in units
 * @param {(mm: string) => string} textOf
 * @param {string} font family
 */
export function paintScaleBar(context, perMm, at, atMost, textOf, font) {
  const mm = NICE_MM.findLast((size) => size * perMm <= atMost);
  if (!mm) return;
  const text = textOf(mm < 1000 ? `${mm} mm` : `${mm / 1000} m`);
  drawScaleBar(context, { ink: '#ffffff', halo: HALO, font }, at, mm * perMm, text);
}
