/** Describes a change field by field, in words. */

import { chainage } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { kindsText } from '../../film/measure/figures.js';
import { ALL_FIELDS } from '../../intake/rig-form/fields.js';

/** Labels of the statements about distances. */
const STATED = {
  measures: kindsText,
  zero: (zero) => t('history.zero_text', { frame: zero.frame, offset: chainage(zero.offset_m) }),
  lengths: (lengths) =>
    lengths
      .map(({ length_m, sigma_mm, first_frame: first, last_frame: last }) =>
        t('history.length_text', { length: chainage(length_m), sigma: sigma_mm, first, last }),
      )
      .join('; ') || t('history.nothing_stated'),
  typed: (typed) =>
    typed.map(({ frame, distance_m: m }) => t('history.zero_text', { frame, offset: chainage(m) })).join('; ') ||
    t('history.nothing_stated'),
  joints: ({ use, marked, left_out: out }) => {
    const counts = { marked: marked?.length ?? 0, out: out?.length ?? 0 };
    if (use === false) return t('history.joints_off');
    return use ? t('history.joints_text', counts) : t('history.joints_auto', counts);
  },
  labels: (labels) => labels.join(', ') || t('history.nothing_stated'),
  attachment: (kind) => wordFor('attach.kind', kind) ?? kind,
  robot: (robot) => (robot === 'moved' ? t('again.moved') : t('again.stood_still')),
  rig_sigma: ({ height_mm: height, focal_px: focal }) => t('history.rig_text', { height, focal }),
};

/** 'Severity', 'Known length'. */
export const labelOf = (name) =>
  ALL_FIELDS.find(({ path }) => path === name)?.label ??
  wordFor('history.field', name) ??
  wordFor('header', name) ??
  name;

/**
 * @param {{action: string, before: object|null, after: object|null}} event
 * @returns {{name: string, before: string|null, after: string|null}[]}
 */
export function differences({ action, before, after }) {
  if (['deleted', 'restored', 'reviewed'].includes(action)) return [];
  const [was, is] = [flat(before), flat(after)];
  return [...new Set([...Object.keys(was), ...Object.keys(is)])]
    .filter((name) => JSON.stringify(was[name] ?? null) !== JSON.stringify(is[name] ?? null))
    .map((name) => ({ name, before: valueText(name, was[name]), after: valueText(name, is[name]) }));
}

/** Returns an inspection's name and header side by side; the remark says why joints were dropped. */
const flat = (fields) => {
  const { header, refusal: _said, ...others } = fields ?? {};
  return { ...others, ...header };
};

/** Returns a value of a field, null where nothing is stated. */
export function valueText(name, value) {
  if (value === null || value === undefined || value === '') return null;
  if (STATED[name]) return STATED[name](value);
  if (name.endsWith('_m') && typeof value === 'number') return chainage(value);
  if (value === true) return t('page.yes');
  if (value === false) return t('page.no');
  if (Array.isArray(value)) return value.map((part) => Math.round(part)).join(', ');
  return wordFor('header.choice', String(value)) ?? String(value);
}
