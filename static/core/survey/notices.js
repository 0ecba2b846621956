/** Disagreements of picture and rig in words: what they mean and what to check. */

import { t } from '../page/words.js';

/** @type {Record<string, (params: Record<string, number>) => string>} */
const TEXTS = {
  scale_changes: (params) => t('notice.scale_changes', params),
  rig_doubted: (params) => t('notice.rig_doubted', params),
  joints_doubted: (params) => t('notice.joints_doubted', params),
  rings_uncounted: (params) => t('notice.rings_uncounted', params),
  height_doubted: (params) => t('notice.height_doubted', params),
  looks_ahead: (params) => t('notice.looks_ahead', params),
  looks_back: (params) => t('notice.looks_back', params),
  looks_left: (params) => t('notice.looks_left', params),
  looks_right: (params) => t('notice.looks_right', params),
  looks_up: (params) => t('notice.looks_up', params),
  looks_down: (params) => t('notice.looks_down', params),
  turned_clockwise: (params) => t('notice.turned_clockwise', params),
  turned_anticlockwise: (params) => t('notice.turned_anticlockwise', params),
};

/** @param {{code: string, params: Record<string, number>}} notice */
export const noticeText = ({ code, params }) => TEXTS[code](params);
