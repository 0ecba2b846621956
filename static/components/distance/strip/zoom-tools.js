/** Buttons that zoom the axis of the strips. */

import { html } from '../../../core/page/html.js';
import { withKey } from '../../../core/page/keys.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const ZOOM_STEP = 0.5;

/** A quiet button of a strip with its key; `word` where there is room for one. */
export const tool = (
  part,
  sign,
  label,
  key,
  word = '',
) => html`<button class="button button--quiet button--small ${word ? '' : 'button--icon'}"
  data-part="${part}" aria-label="${label}" title="${withKey(label, key)}">${icon(sign)}${
    word &&
    html`<span
  class="strip__word">${word}</span>`
  }</button>`;

export const zoomTools = () => html`${tool('out', 'minus', t('strip.zoom_out'), '−')}
  ${tool('whole', 'whole', t('strip.whole'), '0', t('strip.whole_short'))}
  ${tool('in', 'plus', t('strip.zoom_in'), '+')}`;

/**
 * Binds the buttons among `parts`, until `signal` aborts.
 * @param {Record<string, any>} parts
 * @param {Desk} desk
 * @param {AbortSignal} signal
 */
export function bindZoom({ out, whole, in: closer }, desk, signal) {
  out.addEventListener('click', () => zoomAxis(desk, -1), { signal });
  closer.addEventListener('click', () => zoomAxis(desk, 1), { signal });
  whole.addEventListener('click', () => desk.axis.showWhole(), { signal });
  const show = () => (whole.disabled = desk.axis.isWhole);
  desk.axis.addEventListener('change', show, { signal });
  show();
}

/**
 * @param {Desk} desk
 * @param {1|-1} direction 1 zooms in, to the play head where it is visible
 */
export function zoomAxis({ axis, playhead }, direction) {
  const here = playhead.value.row?.distance_mm;
  const about = here !== undefined && axis.holds(here) ? here : undefined;
  axis.zoom(direction > 0 ? ZOOM_STEP : 1 / ZOOM_STEP, about);
}
