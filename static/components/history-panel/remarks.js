/**
 * Translates the server's remarks in the history. The server stores them in English, with their codes and
 * numbers; a person's remark stays unchanged.
 */

import { refusalText } from '../../core/evidence.js';
import { t } from '../../core/words.js';
import { jointsText } from '../interval-detail/interval-detail.js';

const IMPORTED = [[/^Imported from (.+)\.$/s, ([, file]) => t('history.imported_from', { file })]];
/** The server's sentences and ours, by subject. */
const FORMS = {
  created: IMPORTED,
  imported: IMPORTED,
  rescaled: [[/^The joints no longer count\.$/, () => t('history.joints_dropped')]],
  not_told: [
    [/^It answered (\d+)\.$/, ([, status]) => t('history.answered', { status })],
    [/^It answered (\d+), and redirects are not followed\.$/, ([, status]) => t('history.redirected', { status })],
    [/^It did not answer within (\d+) s\.$/, ([, s]) => t('history.no_answer', { s })],
    [/^Its certificate is not trusted: (.+)\.$/s, ([, why]) => t('history.untrusted', { why })],
    [/^TLS failed: (.+)\.$/s, ([, why]) => t('history.tls_failed', { why })],
    [/^Its name is not known\.$/, () => t('history.unknown_name')],
    [/^It has broken off\.$/, () => t('history.broken_off')],
    [/^It cannot be reached: (.+)\.$/s, ([, why]) => t('history.unreachable', { why })],
    [/^It does not answer as a web server does\.$/, () => t('history.no_web_server')],
  ],
};

/** @param {{action: string, after: object|null, remark: string|null}} event */
export function remarkText({ action, after, remark }) {
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
  const { joints_counted: joints, scale, scale_sigma: sigma, camera_lower_mm: lower_mm } = after;
  return jointsText({ joints, scale, sigma, lower_mm });
}
