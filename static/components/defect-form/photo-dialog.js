/** The photo of a defect, enlarged, with the tagged place. */

import { html } from '../../core/html.js';
import { t } from '../../core/words.js';
import { openDialog } from '../dialog/dialog.js';
import { measuresOnPhoto } from '../measure-tool/on-photo.js';

/**
 * @param {object} item the observation
 * @param {string} title
 * @param {{width: number, height: number}} video size of its picture in px
 */
export const showPhoto = ({ photo, pixel, frame, measures }, title, { width, height }) =>
  openDialog({
    title,
    size: 'wide',
    content: html`<div class="photo">
        <img src="${photo}" alt="${t('form.photo_alt', { name: title })}" width="${width}" height="${height}" />
        ${pixel && mark(pixel, width, height)}
        ${measuresOnPhoto({ frame, measures }, width, height)}
      </div>
      <p><a href="${photo}" download>${t('form.photo_save')}</a></p>`,
  });

/** Pixel centres are integers, so the picture begins at -0.5. */
function mark([u, v], width, height) {
  const radius = width / 22;
  return html`<svg class="photo__mark" viewBox="-0.5 -0.5 ${width} ${height}" aria-hidden="true">
    ${['photo__edge', 'photo__line'].map((line) => html`<g class="${line}"><circle cx="${u}" cy="${v}" r="${radius}" />
      <path d="M${u - radius} ${v}h${radius * 0.6}M${u + radius} ${v}h${-radius * 0.6}M${u} ${v - radius}v${radius * 0.6}M${u} ${v + radius}v${-radius * 0.6}" /></g>`)}
  </svg>`;
}
