/** Where picture and rig disagree, in words: what it means and what to check. */

import { t } from './words.js';

const TEXTS = {
  scale_changes: (params) => t('notice.scale_changes', params),
  rig_doubted: (params) => t('notice.rig_doubted', params),
  joints_doubted: (params) => t('notice.joints_doubted', params),
  rings_uncounted: (params) => t('notice.rings_uncounted', params),
  height_doubted: (params) => t('notice.height_doubted', params),
};

/** @param {{code: string, params: Record<string, number>}} notice */
export const noticeText = ({ code, params }) => TEXTS[code](params);
