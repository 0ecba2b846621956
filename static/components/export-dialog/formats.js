/** Every export format of an inspection, in the groups of the menu. */

import { t } from '../../core/words.js';

/**
 * @typedef {object} Format
 * @property {string} kind as the API names it
 * @property {string} name
 * @property {string} help its purpose, in one line
 * @property {('burnt_in'|'clips'|'photos'|'film')[]} [extras] what it shows only where it is asked for
 * @property {boolean} [isWhole] contains everything; asking for its losses would create the file twice
 */

/** @type {{title: string, formats: Format[]}[]} */
export const GROUPS = [
  {
    title: t('export.report'),
    formats: [
      { kind: 'pdf', name: 'PDF', help: t('export.pdf'), extras: ['burnt_in'], isWhole: true },
      { kind: 'html', name: 'HTML', help: t('export.html'), extras: ['burnt_in'], isWhole: true },
    ],
  },
  {
    title: t('export.tables'),
    formats: [
      { kind: 'xlsx', name: 'XLSX', help: t('export.xlsx') },
      { kind: 'csv', name: 'CSV', help: t('export.csv') },
      { kind: 'json', name: 'JSON', help: t('export.json'), extras: ['photos'] },
    ],
  },
  {
    title: t('export.exchange'),
    formats: [
      { kind: 'en13508', name: 'EN 13508-2', help: t('export.en13508') },
      { kind: 'ribx', name: 'RIBX', help: t('export.ribx') },
      { kind: 'isybau', name: 'ISYBAU', help: t('export.isybau') },
      { kind: 'm150', name: 'DWA-M 150', help: t('export.m150') },
      { kind: 'geojson', name: 'GeoJSON', help: t('export.geojson') },
    ],
  },
  {
    title: t('export.evidence'),
    formats: [{ kind: 'zip', name: 'ZIP', help: t('export.zip'), extras: ['burnt_in', 'clips'], isWhole: true }],
  },
  {
    title: t('export.move'),
    formats: [{ kind: 'archive', name: t('export.archive_name'), help: t('export.archive'), extras: ['film'], isWhole: true }],
  },
];

/** The act-now sheet. */
export const EMERGENCY = {
  kind: 'emergency',
  name: t('export.emergency'),
  help: t('export.emergency_help'),
  extras: ['burnt_in'],
  isWhole: true,
};

/** @param {string} kind */
export const formatOf = (kind) =>
  [EMERGENCY, ...GROUPS.flatMap(({ formats }) => formats)].find((format) => format.kind === kind);
