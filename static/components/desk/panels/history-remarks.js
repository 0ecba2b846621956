/**
 * Translates the server's remarks in the history. The server stores them in English, with their codes and
 * numbers; a person's remark stays unchanged.
 */

import { reasonText } from '../../../core/server/alerts.js';
import { refusalText } from '../../../core/survey/evidence.js';
import { t } from '../../../core/page/words.js';
import { jointsText } from '../../distance/readout/interval-detail.js';

const IMPORTED = [[/^Imported from (.+)\.$/s, ([, file]) => t('history.imported_from', { file })]];
/** The server's sentences and ours, by subject. */
const FORMS = {
  created: IMPORTED,
  imported: IMPORTED,
  rescaled: [[/^The joints no longer count\.$/, () => t('history.joints_dropped')]],
};

/** @param {{action: string, after: object|null, remark: string|null, reason: object|null}} event */
export function remarkText({ action, after, remark, reason }) {
  if (reason) return reasonText(reason, remark);
  const said = action === 'rescaled' && after ? rescaledText(after) : null;
  if (said) return said;
  for (const [pattern, words] of FORMS[action] ?? []) {
    const match = pattern.exec(remark ?? '');
    if (match) return words(match);
  }
  return remark;
}

function rescaledText(after) {
  if (!('scale' in after)) return refusalText(after.refusal);
  const {
    joints_counted: joints,
    lengths_counted: lengths,
    scale,
    scale_sigma: sigma,
    camera_lower_mm: lower_mm,
  } = after;
  return jointsText({ joints, lengths, scale, sigma, lower_mm });
}
