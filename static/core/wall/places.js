/** Parses what a person types to go somewhere: a distance, a time, a frame or a joint. */

import { parseDistance } from './units.js';

/**
 * '12.40' or '40.7 ft', '3:20' or '1:02:03.5', '#1200', 'j3'; null for anything else.
 * @param {string} typed
 * @returns {{kind: 'distance'|'time'|'frame'|'joint', value: number}|null} metres, seconds, numbers
 */
export function parsePlace(typed) {
  const text = typed.trim();
  const frame = /^#\s*(\d{1,9})$/.exec(text);
  if (frame) return { kind: 'frame', value: Number(frame[1]) };
  const joint = /^j\s*(\d{1,6})$/i.exec(text);
  if (joint) return { kind: 'joint', value: Number(joint[1]) };
  const time = /^(?:(\d+):)?(\d{1,3}):(\d{1,2}(?:[.,]\d+)?)$/.exec(text);
  if (time) {
    const [hours, minutes, seconds] = time.slice(1).map((part) => Number((part ?? '0').replace(',', '.')));
    return { kind: 'time', value: 3600 * hours + 60 * minutes + seconds };
  }
  const metres = parseDistance(text);
  return metres === null ? null : { kind: 'distance', value: metres };
}
