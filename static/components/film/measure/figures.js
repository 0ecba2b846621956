/** Measures in words, and the figure of each. */

import { shownSize } from '../../../core/wall/measure.js';
import { roundedUp } from '../../../core/wall/rounding.js';
import { wordFor } from '../../../core/page/words.js';

const UNITS = { mm: 'mm', mm2: 'mm²' };

/** 'Width', 'Depth of a bed or of water'. */
export const kindText = (kind) => wordFor('measure.kind', kind);

/** Names the kinds of some measures, for histories: 'Width, Length'. */
export const kindsText = (measures) => measures.map(({ kind }) => kindText(kind)).join(', ');

/** '12 ± 1 mm', '42 ± 3 mm (14.0 ± 1.0 %)'; '–' where nothing can be derived. */
export function figureText(figure) {
  if (!figure) return '–';
  const { value, u95, unit, percent, percent_u95: percentU95 } = figure;
  const size = `${withInterval(value, u95)} ${UNITS[unit]}`;
  return percent === null ? size : `${size} (${withInterval(percent, percentU95)} %)`;
}

/** Whole numbers from 10 on, where the interval has no need of tenths. */
function withInterval(value, u95) {
  if (u95 === null) return String(shownSize(value)).replace('-', '−');
  const digits = u95 < 1 ? 1 : 0;
  return `${value.toFixed(digits).replace('-', '−')} ± ${roundedUp(u95, digits).toFixed(digits)}`;
}
