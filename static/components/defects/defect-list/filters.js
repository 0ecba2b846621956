/** The filters of the list, and what each defect still lacks. */

import { t } from '../../../core/page/words.js';

const LACKS = {
  code: t('lacks.code'),
  char1: t('lacks.char1'),
  char2: t('lacks.char2'),
  clock: t('lacks.clock'),
  quant1: t('lacks.quant1'),
  quant2: t('lacks.quant2'),
  remark: t('lacks.remark'),
};

/** 'no code', 'clock missing': what prevents reporting it. */
export const lacksOf = (item, catalogue) => catalogue.missing(item).map((name) => LACKS[name]);

const atLeast =
  (grade) =>
  ({ severity }) =>
    (severity ?? -1) >= grade;

export const FILTERS = [
  { name: 'all', label: t('defects.all'), passes: () => true },
  { name: 'lacking', label: t('defects.lacking'), passes: (item, catalogue) => catalogue.missing(item).length > 0 },
  { name: 'unrated', label: t('defects.unrated'), passes: ({ severity }) => (severity ?? null) === null },
  { name: 'from3', label: t('defects.from_grade', { grade: 3 }), passes: atLeast(3) },
  { name: 'from4', label: t('defects.from_grade', { grade: 4 }), passes: atLeast(4) },
  { name: 'act', label: t('defects.act_now'), passes: atLeast(5) },
  { name: 'stretches', label: t('defects.stretches'), passes: ({ continuous }) => Boolean(continuous) },
];

/**
 * Returns a test for observations: every word of the text is in its code, label or remark.
 * @param {string} text
 * @param {string} filter name of one of FILTERS
 * @param {import('../../../core/defects/codes.js').Catalogue} catalogue
 */
export function matcher(text, filter, catalogue) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const { passes } = FILTERS.find(({ name }) => name === filter);
  return (item) => {
    const { code, char1, char2, remark, continuous } = item;
    const said = [code, char1, char2, catalogue.label(code, char1, char2), remark, continuous].join(' ').toLowerCase();
    return passes(item, catalogue) && words.every((word) => said.includes(word));
  };
}
