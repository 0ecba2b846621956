/** What measuring draws over the photo of a defect. */

import { html } from '../../../core/page/html.js';
import { squareOf, toSquare } from '../../../core/wall/pixels.js';

/**
 * Returns the measures that were clicked in the frame of the photo, as a picture above it.
 * @param {{frame: number, measures: import('../../../core/wall/measure.js').Measure[]|null}} item
 * @param {import('../../../core/wall/pixels.js').Video} video
 */
export function measuresOnPhoto({ frame, measures }, video) {
  const { width, height } = squareOf(video);
  const here = (measures ?? []).filter(({ points }) => points.every((point) => point.frame === frame));
  return (
    here.length > 0 &&
    html`<svg class="photo__sizes covers" viewBox="-0.5 -0.5 ${width} ${height}" aria-hidden="true">
    ${here.map(({ kind, points }) => {
      const line = points.map(({ pixel }) => toSquare(video, pixel).join(' ')).join('L');
      const path = `M${line}${kind === 'area' ? 'Z' : ''}`;
      return html`<path d="${path}" /><path class="photo__size" d="${path}" />`;
    })}
  </svg>`
  );
}
