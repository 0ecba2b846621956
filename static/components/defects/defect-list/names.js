/** Names of observations. */

import { stretchNumber, stretchRole } from '../../../core/defects/stretches.js';
import { BY_CAMERA } from '../../../core/survey/track.js';
import { chainage, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';

/** 'BAB at 3.42 m' */
export const nameOf = ({ code, distance_m }) =>
  t('desk.at', { what: code || t('desk.tag'), where: chainage(distance_m) });

/**
 * '± 0.03 m', and what the distance rests on unless that is the camera: '± 0.05 m, by the counter'.
 * @param {{distance_u95_m?: number|null, distance_source?: string|null}} observation
 */
export function intervalText({ distance_u95_m: u95M, distance_source: source }) {
  const isNamed = source && u95M !== null && !BY_CAMERA.has(source);
  return isNamed ? `${plusMinus(u95M)}, ${wordFor('distance_source', source)}` : plusMinus(u95M);
}

/** 'start of stretch 2'; null of a point. */
export const roleText = (observation) =>
  wordFor('stretch_role', stretchRole(observation), { number: stretchNumber(observation) });
