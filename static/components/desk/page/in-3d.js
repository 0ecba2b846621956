/** Ties the 3D view to the desk: it follows the shown frame and the selection, and its clicks tag, mark or select. */

import { listenTo } from '../../../core/page/store.js';
import { refusalIn } from '../../../core/server/api.js';
import { frameShowing } from '../../../core/wall/wall.js';
import { t } from '../../../core/page/words.js';

/** How often the robot follows the shown frame. */
const SHOW_EVERY_MS = 66;

/** @param {Desk} desk @param {AbortSignal} signal */
export function followIn3d(desk, signal) {
  const { live, playhead, selection } = desk;
  let shown = -1;
  let timer = 0;

  const show = () => {
    const { frame, isLive } = playhead.value;
    const wanted = isLive ? null : frame; // null: the robot follows the tracker
    if (frame < 0 || wanted === shown || timer) return;
    if (live.send({ type: 'show', frame: wanted })) shown = wanted;
    timer = setTimeout(() => {
      timer = 0;
      show();
    }, SHOW_EVERY_MS);
  };
  const select = () => live.send({ type: 'select', observation: selection.value });

  playhead.addEventListener('change', show, { signal });
  selection.addEventListener('change', select, { signal });
  listenTo(live, 'state', signal, () => {
    shown = -1;
    show();
    select();
  });
  live.addEventListener('pin_click', ({ detail }) => desk.goTo(detail.observation), { signal });
  live.addEventListener('wall_click', ({ detail }) => wallClicked(desk, detail, signal), { signal });
}

/** Handles a click on the wall: tags the place, or marks it where marks are wanted. */
async function wallClicked(desk, { distance_m, clock_h, lateral_m }, signal) {
  const place = { distance_m, clock_h, right_mm: 1000 * lateral_m };
  const { value: pick } = desk.picking; // what the click was for
  try {
    const found = await frameShowing(desk.inspection.id, place, desk.playhead.value.frame, signal);
    if (!found) desk.fault(t('wall.not_seen'));
    else if (!pick) desk.tag(found);
    else if (pick === desk.picking.value) pick(found);
  } catch (error) {
    const refusal = refusalIn(error);
    if (refusal) desk.fault(refusal);
  }
}
