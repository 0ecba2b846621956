/** Describes a step of the history: 'severity 3 → 4 of BAB at 3.42 m'. */

import { t, withinSentence, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { labelOf } from '../panels/differences.js';

/** A tooltip has room for so many letters of a remark. */
const MOST_LETTERS = 24;

/** @param {import('../../../core/defects/history.js').Step} step */
export function stepName({ what, item, changes = [] }) {
  const [change] = changes;
  const values = { name: item ? nameOf(item) : '', n: changes.length };
  switch (what) {
    case 'edit': {
      const { before, after } = change;
      if ('measures' in after) return t('step.measure', values);
      if ('frame' in after) return t('step.move', values);
      return t('step.edit', { ...values, ...firstDifference(before, after) });
    }
    case 'header':
      return t('step.header', firstDifference({ [change.name]: change.before }, { [change.name]: change.after }));
    case 'remark':
      if (change.kind === 'settled') return t('step.settled', values);
      return t('step.remark', { ...values, kind: wordFor('remark', change.kind) });
    default:
      return wordFor('step', what, { ...values, what: wordFor('attach.kind', change?.kind) });
  }
}

/** Returns the first field that differs, before and after; a code is shown with its characters. */
function firstDifference(before, after) {
  if ('code' in after) {
    const whole = ({ code, char1, char2 }) => [code, char1, char2].filter(Boolean).join(' ') || '–';
    return { field: withinSentence(labelOf('code')), before: whole(before), after: whole(after) };
  }
  const name = Object.keys(after).find((key) => (before[key] ?? null) !== (after[key] ?? null));
  return { field: withinSentence(labelOf(name)), before: text(before[name]), after: text(after[name]) };
}

function text(value) {
  if ((value ?? '') === '') return '–';
  const words = wordFor('header.choice', String(value)) ?? String(value);
  return words.length > MOST_LETTERS ? `${words.slice(0, MOST_LETTERS - 1)}…` : words;
}
