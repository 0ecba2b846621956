/** Severity 0 to 5 as shape and colour together, the same in lists and on canvases. */

import { html } from '../../../core/page/html.js';
import { t, wordFor } from '../../../core/page/words.js';

/** The grades; ours, not a PACP, MSCC or DWA grade. */
export const GRADES = [0, 1, 2, 3, 4, 5];

/** The severity that must not wait. */
export const GRAVEST = 5;

/** Outlines on a 20 x 20 grid: ring, disc, square, diamond, triangle, octagon with its mark. */
const OUTLINES = [
  'M10 4a6 6 0 1 0 .01 0zM10 7.500a2.500 2.500 0 1 1-.01 0z',
  'M10 4a6 6 0 1 0 .01 0z',
  'M4.500 4.500h11v11h-11z',
  'M10 2.500L17.500 10 10 17.500 2.500 10z',
  'M10 2.500L18 17H2z',
  'M6.700 2h6.600L18 6.700v6.600L13.300 18H6.700L2 13.300V6.700zM9 5.500v5.500h2V5.500zM9 12.800v2h2v-2z',
];
const UNRATED = 'M10 4a6 6 0 1 0 .01 0zM10 6a4 4 0 1 1-.01 0z';

const nameOf = (severity) => (severity === null || severity === undefined ? 'none' : severity);

/** Returns the meaning of the grade: 'plan repair', 'not rated'. */
export const severityWord = (severity) => wordFor('severity', String(nameOf(severity)));

export const severityText = (severity) =>
  nameOf(severity) === 'none'
    ? severityWord(severity)
    : t('severity.label', { grade: severity, word: severityWord(severity) });

export function severityMark(severity) {
  const outline = OUTLINES[severity] ?? UNRATED;
  return html`<svg class="severity severity--${nameOf(severity)}" viewBox="0 0 20 20" role="img"
    aria-label="${severityText(severity)}"><path fill-rule="evenodd" d="${outline}" /></svg>`;
}

/** The worst severity of several defects; null is none. */
export function worstMarkup(severity) {
  if (severity === null) return html`<span class="dim">–</span>`;
  const word = severityWord(severity);
  return html`<span class="inspection__worst inline-row">${severityMark(severity)}<b>${severity}</b>
    ${severity === GRAVEST ? html`<b>${word}</b>` : html`<span class="dim">${word}</span>`}</span>`;
}

const paths = new Map();

/** Draws the mark centred at (x, y), `size` px wide, in the colours of the page. */
export function drawSeverity(context, severity, x, y, size, styles) {
  const outline = OUTLINES[severity] ?? UNRATED;
  if (!paths.has(outline)) paths.set(outline, new Path2D(outline));
  context.save();
  context.translate(x - size / 2, y - size / 2);
  context.scale(size / 20, size / 20);
  context.fillStyle = styles.getPropertyValue(`--severity-${nameOf(severity)}`);
  context.strokeStyle = styles.getPropertyValue('--sunken');
  context.lineWidth = 2;
  context.stroke(paths.get(outline));
  context.fill(paths.get(outline), 'evenodd');
  context.restore();
}
