/** The small picture of an inspection: the photo of its worst defect, else a frame of its film. */

import { html } from '../../../core/page/html.js';
import { icon } from '../icon/icon.js';

/** The picture; with another `state` of the inspection the browser asks whether it is another one. */
export const thumbnailImage = (id, state) =>
  html`<img src="/api/inspections/${id}/thumbnail?of=${state}" alt="" loading="lazy" width="88" height="56" />`;

/** The frame of a picture; without a film it shows a sign, so that the rows stay in line. */
export const thumbnail = (id, state = '') =>
  html`<span class="thumbnail">${icon('film')}<span data-part="picture">${id && thumbnailImage(id, state)}</span></span>`;

/** Hides pictures within an element that do not exist, or cannot be made. */
export function followThumbnails(element, signal) {
  for (const [event, isMissing] of [
    ['error', true],
    ['load', false],
  ]) {
    const show = ({ target }) => target.closest('.thumbnail')?.classList.toggle('thumbnail--missing', isMissing);
    element.addEventListener(event, show, { capture: true, signal }); // these events do not bubble
  }
}
