/** Two versions of the same thing, field by field, in the words of the page. */

import { isSame } from '../../../core/survey/corrections.js';
import { clockHour } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { roleText } from '../../defects/defect-list/names.js';
import { kindsText } from '../../film/measure/figures.js';
import { unitOf } from '../../defects/defect-form/units.js';
import { labelOf, valueText } from '../panels/differences.js';
import { severityText } from '../../shared/severity-mark/severity-mark.js';

/**
 * Returns the fields that either version states, and whether they differ.
 * @param {import('../../../core/defects/conflicts.js').Conflict} conflict
 * @param {import('../../../core/defects/codes.js').Catalogue} catalogue
 * @returns {{label: string, mine: string, theirs: string, isOther: boolean}[]} '' where nothing is stated
 */
export function rowsOf({ kind, mine, theirs }, catalogue) {
  const [own, stored] = [mine ?? {}, theirs ?? {}];
  return FIELDS[kind](own, catalogue)
    .map(({ label, names, text }) => ({
      label,
      mine: text(own),
      theirs: text(stored),
      isOther: names.some((name) => !isSame(own[name] ?? null, stored[name] ?? null)),
    }))
    .filter((row) => row.mine || row.theirs);
}

function fieldsOfObservation(_mine, catalogue) {
  const quantity = (n) => ({
    label: labelOf(`quant${n}`),
    names: [`quant${n}`],
    text: ({ code, char1, char2, ...fields }) => {
      const value = fields[`quant${n}`] ?? null;
      return value === null ? '' : `${value} ${unitOf(catalogue.row(code, char1, char2), n)}`.trim();
    },
  });
  return [
    {
      label: labelOf('code'),
      names: ['code', 'char1', 'char2'],
      text: ({ code, char1, char2 }) =>
        code ? `${[code, char1, char2].filter(Boolean).join(' ')} ${catalogue.label(code, char1, char2)}` : '',
    },
    {
      label: labelOf('severity'),
      names: ['severity'],
      text: ({ severity }) => ((severity ?? null) === null ? '' : severityText(severity)),
    },
    { label: t('dial.label'), names: ['clock_from', 'clock_to'], text: clockText },
    quantity(1),
    quantity(2),
    { label: labelOf('continuous'), names: ['continuous'], text: (fields) => roleText(fields) ?? '' },
    ...['remark', 'recommendation', 'cost'].map((name) => ({
      label: labelOf(name),
      names: [name],
      text: (fields) => String(fields[name] ?? ''),
    })),
    {
      label: labelOf('measures'),
      names: ['measures'],
      text: ({ measures }) => kindsText(measures ?? []),
    },
    { label: t('form.place'), names: ['frame', 'pixel'], text: placeText },
  ];
}

function clockText({ clock_from: from, clock_to: to }) {
  if (from && to) return t('units.clock_sector', { from, to });
  return from ? clockHour(from) : '';
}

function placeText({ frame, pixel }) {
  const place = pixel && t('form.pixel', { pixel: pixel.map(Math.round).join(', ') });
  return [frame !== undefined && t('form.frame', { frame }), place].filter(Boolean).join(' · ');
}

/** The fields in conflict. */
const fieldsOfHeader = (mine) =>
  Object.keys(mine).map((name) => ({
    label: labelOf(name),
    names: [name],
    text: (fields) => {
      const text = valueText(name, fields[name]) ?? '';
      return text && name.endsWith('_mm') ? `${text} mm` : text;
    },
  }));

const fieldsOfCorrections = (mine) =>
  Object.keys(mine).map((name) => ({
    label: labelOf(name),
    names: [name],
    text: (fields) => [valueText(name, fields[name]), framesText(fields[name])].filter(Boolean).join(' · '),
  }));

/** Places of marked or omitted joints: equal numbers may hide different joints. */
function framesText(value) {
  const frames = [...(value?.marked ?? []), ...(value?.left_out ?? [])].map(({ frame }) => frame);
  return frames.length ? t('conflict.frames', { frames: frames.join(', ') }) : '';
}

const FIELDS = { observation: fieldsOfObservation, header: fieldsOfHeader, corrections: fieldsOfCorrections };
