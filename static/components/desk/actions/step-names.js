/** Describes a step of the history: 'severity 3 → 4 of BAB at 3.42 m'. */

import { t, withinSentence, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { labelOf } from '../panels/differences.js';

/** @param {import('../../../core/defects/history.js').Step} step */
export const stepName = ({ what, item, changes }) => NAMES[what](item, changes);

const NAMES = {
  tag: (item) => t('step.tag', { name: nameOf(item) }),
  delete: (item) => t('step.delete', { name: nameOf(item) }),
  edit: (item, [{ before, after }]) => {
    if ('measures' in after) return t('step.measure', { name: nameOf(item) });
    if ('frame' in after) return t('step.move', { name: nameOf(item) });
    return t('step.edit', { name: nameOf(item), ...firstDifference(before, after) });
  },
  restore: (item) => t('step.restore', { name: nameOf(item) }),
  stretch: (item, changes) => t('step.stretch', { name: nameOf(item), n: changes.length }),
  header: (item, changes) => {
    const [{ name, before, after }] = changes;
    return t('step.header', { ...firstDifference({ [name]: before }, { [name]: after }) });
  },
  remark: (item, [{ kind }]) =>
    kind === 'settled'
      ? t('reviewing.step_settled', { name: nameOf(item) })
      : t('reviewing.step', { kind: wordFor('remark', kind), name: nameOf(item) }),
  correction: () => t('step.correction'),
  attach: (item, [{ kind }]) => t('step.attach', { what: wordFor('attach.kind', kind), name: nameOf(item) }),
  detach: (item, [{ kind }]) => t('step.detach', { what: wordFor('attach.kind', kind), name: nameOf(item) }),
  draw: (item) => t('step.draw', { name: nameOf(item) }),
  order: (item) => t('step.order', { name: nameOf(item) }),
};

/** Returns the first field that differs, before and after; a code is shown with its characters. */
function firstDifference(before, after) {
  if ('code' in after) {
    const whole = ({ code, char1, char2 }) => [code, char1, char2].filter(Boolean).join(' ') || '–';
    return { field: withinSentence(labelOf('code')), before: whole(before), after: whole(after) };
  }
  const name = Object.keys(after).find((key) => (before[key] ?? null) !== (after[key] ?? null));
  return { field: withinSentence(labelOf(name)), before: text(before[name]), after: text(after[name]) };
}

/** Shortens long remarks for a tooltip. */
const text = (value) => {
  if (value === null || value === undefined || value === '') return '–';
  const words = wordFor('header.choice', String(value)) ?? String(value);
  return words.length > 24 ? `${words.slice(0, 23)}…` : words;
};
