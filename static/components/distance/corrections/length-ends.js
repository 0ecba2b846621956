/** The two frames between which a length is known: shown, visited, taken from the play head. */

import { listenTo } from '../../../core/page/store.js';
import { html } from '../../../core/page/html.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { placeText } from './fields.js';

/** Parts: first, last (buttons that go there), fromHere, toHere. */
export const endsMarkup = () => html`<dl class="ends stack gap-1">
  <div><dt class="small dim">${t('corrections.from')}</dt><dd class="row wrap apart"><button class="link number" data-part="first"></button>
    <button class="button button--small" data-part="fromHere">${t('corrections.from_here')}</button></dd></div>
  <div><dt class="small dim">${t('corrections.to')}</dt><dd class="row wrap apart"><button class="link number" data-part="last"></button>
    <button class="button button--small" data-part="toHere">${t('corrections.to_here')}</button></dd></div>
</dl>`;

/**
 * @param {Record<string, HTMLButtonElement>} parts
 * @param {Desk} desk
 * @param {{first_frame: number|null, last_frame: number|null}} length
 */
export function showEnds(parts, desk, { first_frame: first, last_frame: last }) {
  for (const [part, frame] of Object.entries({ first, last })) {
    const row = frame === null ? null : desk.track.row(frame);
    parts[part].textContent =
      frame === null ? t('corrections.not_marked') : placeText(frame, row && chainage(row.distance_mm / 1000));
    parts[part].disabled = row === null;
    parts[part].dataset.frame = String(frame ?? '');
  }
}

/**
 * Calls `mark` with the changes when an end is taken from the play head.
 * @param {Record<string, HTMLButtonElement>} parts
 * @param {Desk} desk
 * @param {AbortSignal} signal
 * @param {(change: {first_frame?: number, last_frame?: number}) => void} mark
 */
export function bindEnds(parts, desk, signal, mark) {
  listenTo([parts.first, parts.last], 'click', signal, ({ currentTarget }) =>
    desk.seek(Number(currentTarget.dataset.frame)),
  );
  const here = (name) => () => {
    const { frame, row } = desk.playhead.value;
    if (row) mark({ [name]: frame });
    else desk.fault(t('desk.not_tracked'));
  };
  parts.fromHere.addEventListener('click', here('first_frame'), { signal });
  parts.toHere.addEventListener('click', here('last_frame'), { signal });
}
