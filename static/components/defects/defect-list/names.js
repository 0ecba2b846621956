/** Names of observations. */

import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/** 'BAB at 3.42 m' */
export const nameOf = ({ code, distance_m }) =>
  t('desk.at', { what: code || t('desk.tag'), where: chainage(distance_m) });
