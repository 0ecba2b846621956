/** Names of observations. */

import { stretchNumber, stretchRole } from '../../../core/defects/stretches.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/** 'BAB at 3.42 m' */
export const nameOf = ({ code, distance_m }) =>
  t('desk.at', { what: code || t('desk.tag'), where: chainage(distance_m) });

/** 'start of stretch 2'; undefined of a point. */
export function roleText(observation) {
  const number = stretchNumber(observation);
  return {
    A: t('stretch.role_start', { number }),
    B: t('stretch.role_finish', { number }),
    C: t('stretch.role_change', { number }),
  }[stretchRole(observation)];
}
