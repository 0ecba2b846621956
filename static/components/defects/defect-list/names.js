/** Names of observations. */

import { stretchNumber, stretchRole } from '../../../core/defects/stretches.js';
import { chainage } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';

/** 'BAB at 3.42 m' */
export const nameOf = ({ code, distance_m }) =>
  t('desk.at', { what: code || t('desk.tag'), where: chainage(distance_m) });

/** 'start of stretch 2'; null of a point. */
export const roleText = (observation) =>
  wordFor('stretch_role', stretchRole(observation), { number: stretchNumber(observation) });
