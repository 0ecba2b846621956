/** Keeps the axis of the strips at the run and at the play head. */

import { listenTo } from '../page/store.js';

/**
 * Follows the growing track, the play head where it was visible, and the selection.
 * @param {Pick<Desk, 'axis'|'track'|'playhead'|'selection'|'observations'>} desk
 * @param {AbortSignal} signal
 */
export function followRun({ axis, track, playhead, selection, observations }, signal) {
  /** @type {{mm: number, isLive: boolean}|null} */
  let seen = null;
  track.addEventListener('change', () => axis.setRun(track.range), { signal });
  // A person who looks elsewhere is not disturbed.
  listenTo(playhead, 'change', signal, () => {
    const { row, isLive } = playhead.value;
    const before = seen;
    seen = row && { mm: row.distance_mm, isLive };
    if (row && isLive) {
      if (!before?.isLive) axis.letFollow();
      axis.follow(row.distance_mm);
    } else if (row && before && axis.holds(before.mm)) axis.reveal(row.distance_mm);
  });
  listenTo(selection, 'change', signal, () => {
    const metres = selection.value && observations.find(selection.value)?.distance_m;
    if (typeof metres === 'number') axis.reveal(metres * 1000);
  });
}
