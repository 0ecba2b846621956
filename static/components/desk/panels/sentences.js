/** The sentence of each check, by its code, in the language of the page. */

import { chainage } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { withSign } from '../../distance/corrections/known-length.js';

const FIELDS = {
  char1: t('form.kind'),
  char2: t('form.detail'),
  quant1: t('form.quantity'),
  quant2: t('form.quantity_2'),
  clock_from: t('form.clock_from'),
};

const SENTENCES = {
  header_field_empty: ({ field }) => t('checks.header_field_empty', { field: wordFor('header', field) ?? field }),
  abandoned_without_reason: () => t('checks.abandoned_without_reason'),
  no_start: (params) => t('checks.no_start', params),
  no_finish: (params) => t('checks.no_finish', params),
  not_tracked: (params) => t('checks.not_tracked', params),
  before_zero: (params) => t('checks.before_zero', params),
  beyond_end: (params) => t('checks.beyond_end', { ...params, length: chainage(params.known_length_m) }),
  no_code: (params) => t('checks.no_code', params),
  unknown_code: (params) => t('checks.unknown_code', params),
  unknown_character: (params) =>
    t('checks.unknown_character', { ...params, field: FIELDS[params.field] ?? params.field }),
  attribute_missing: (params) =>
    t('checks.attribute_missing', { ...params, field: FIELDS[params.field] ?? params.field }),
  photo_missing: (params) => t('checks.photo_missing', params),
  severe_without_photo: (params) => t('checks.severe_without_photo', params),
  open_stretch: (params) => t('checks.open_stretch', params),
  stretch_without_start: (params) => t('checks.stretch_without_start', params),
  stretch_number_twice: (params) => t('checks.stretch_number_twice', params),
  stretch_codes_differ: (params) => t('checks.stretch_codes_differ', params),
  stretch_falls: (params) => t('checks.stretch_falls', params),
  stretch_is_point: (params) => t('checks.stretch_is_point', params),
  stretch_long: (params) => t('checks.stretch_long', params),
  stretches_overlap: (params) => t('checks.stretches_overlap', params),
  outdated: () => t('outdated.text'),
  lost: (params) => t('checks.lost', params),
  length_unknown: () => t('checks.length_unknown'),
  end_not_reached: (params) => t('checks.end_not_reached', { short: chainage(params.short_m) }),
  correction_failed: () => t('checks.correction_failed'),
  length_forced: (params) => t('checks.length_forced', { residual: withSign(params.residual_mm, 0) }),
  duplicate: (params) => t('checks.duplicate', params),
  other_without_remark: (params) => t('checks.other_without_remark', params),
  no_joint_near: (params) => t('checks.no_joint_near', params),
};

/**
 * @param {Api['IssueOut']} issue
 * @param {object|null} observation of the issue
 */
export function sentenceOf({ code, detail, params }, observation) {
  const words = SENTENCES[code];
  return words ? words({ ...params, name: observation ? nameOf(observation) : '' }) : detail;
}
