/** Stretches of the film in which the tracker had lost the wall. */

import { STATUSES } from './track.js';

const LOST = STATUSES.indexOf('lost');

/**
 * Returns the runs of lost frames in order: [{first, last}], both within the run.
 * @param {import('../page/columns.js').Column} status of each frame, as in the track
 */
export function lostRuns(status) {
  const runs = [];
  for (let first = status.indexOf(LOST); first >= 0; ) {
    let end = first;
    while (end < status.length && status[end] === LOST) end += 1;
    runs.push({ first, last: end - 1 });
    first = status.indexOf(LOST, end);
  }
  return runs;
}
