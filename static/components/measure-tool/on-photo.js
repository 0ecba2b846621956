/** What measuring draws over the photo of a defect. */

import { html } from '../../core/html.js';

/**
 * Returns the measures that were clicked in the frame of the photo, as a picture above it.
 * @param {{frame: number, measures: import('../../core/measure.js').Measure[]|null}} item
 * @param {number} width of the photo in px; pixel centres are integers
 * @param {number} height
 */
export function measuresOnPhoto({ frame, measures }, width, height) {
  const here = (measures ?? []).filter(({ points }) => points.every((point) => point.frame === frame));
  return (
    here.length > 0 &&
    html`<svg class="photo__sizes" viewBox="-0.5 -0.5 ${width} ${height}" aria-hidden="true">
    ${here.map(({ kind, points }) => {
      const line = points.map(({ pixel }) => pixel.join(' ')).join('L');
      const path = `M${line}${kind === 'area' ? 'Z' : ''}`;
      return html`<path d="${path}" /><path class="photo__size" d="${path}" />`;
    })}
  </svg>`
  );
}
