/**
 * Translates the server's remarks in the history. The server stores them in English, with their codes and
 * numbers; a person's remark stays unchanged.
 */

import { reasonText } from '../../../core/server/alerts.js';
import { refusalText } from '../../../core/survey/evidence.js';
import { t } from '../../../core/page/words.js';
import { jointsText } from '../../distance/readout/interval-detail.js';

/** @param {{action: string, after: object|null, remark: string|null, reason: object|null}} event */
export function remarkText({ action, after, remark, reason }) {
  if (reason) return reasonText(reason, remark);
  if (action === 'rescaled') {
    if (/^Neither joints nor a counter count\.$/.test(remark)) return t('history.nothing_counts');
    return (after && rescaledText(after)) ?? remark;
  }
  const [, file] = /^Imported from (.+)\.$/s.exec(remark ?? '') ?? [];
  return file && ['created', 'imported'].includes(action) ? t('history.imported_from', { file }) : remark;
}

function rescaledText(after) {
  if ('refusal' in after) return refusalText(after.refusal);
  const carried = 'counter_percent' in after && t('issue.counter_carries', { percent: after.counter_percent });
  return [scaleText(after), carried].filter(Boolean).join(' ');
}

function scaleText(after) {
  if (!('scale' in after)) return '';
  const { crests_counted: crests, joints_counted: joints, lengths_counted: lengths, scale, scale_sigma: sigma } = after;
  const of = crests === undefined ? 'joints' : 'crests';
  return jointsText({ of, joints: crests ?? joints, lengths, scale, sigma, lower_mm: after.camera_lower_mm });
}
