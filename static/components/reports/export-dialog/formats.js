/** Every export format of an inspection, in the groups of the menu. */

import { html } from '../../../core/page/html.js';
import { LANGUAGES, language, t } from '../../../core/page/words.js';

/**
 * @typedef {object} Format
 * @property {string} kind as the API names it
 * @property {string} name
 * @property {string} help its purpose, in one line
 * @property {('burnt_in'|'clips'|'photos'|'film'|'csv_german')[]} [extras] what it shows only where it is asked for
 * @property {boolean} [isWhole] contains everything; asking for its losses would create the file twice
 * @property {boolean} [isOrdered] may be as large as a film: the server makes it as an order, with progress
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
      { kind: 'csv', name: 'CSV', help: t('export.csv'), extras: ['csv_german'] },
      { kind: 'json', name: 'JSON', help: t('export.json'), extras: ['photos'] },
    ],
  },
  {
    title: t('export.exchange'),
    formats: [
      { kind: 'en13508', name: 'EN 13508-2', help: t('export.en13508') },
      { kind: 'en13508xml', name: 'EN 13508-2 XML', help: t('export.en13508xml') },
      { kind: 'ribx', name: 'RIBX', help: t('export.ribx') },
      { kind: 'isybau', name: 'ISYBAU', help: t('export.isybau') },
      { kind: 'isybau2024', name: 'ISYBAU-2024', help: t('export.isybau2024') },
      { kind: 'm150', name: 'DWA-M 150', help: t('export.m150') },
      { kind: 'geojson', name: 'GeoJSON', help: t('export.geojson') },
    ],
  },
  {
    title: t('export.evidence'),
    formats: [
      { kind: 'zip', name: 'ZIP', help: t('export.zip'), extras: ['burnt_in', 'clips'], isWhole: true },
      {
        kind: 'delivery',
        name: t('export.delivery'),
        help: t('export.delivery_help'),
        extras: ['burnt_in', 'film'],
        isWhole: true,
        isOrdered: true,
      },
    ],
  },
  {
    title: t('export.move'),
    formats: [
      { kind: 'archive', name: t('export.archive_name'), help: t('export.archive'), extras: ['film'], isWhole: true },
    ],
  },
];

/** What most clients want; the others are folded away. */
export const IN_FRONT = ['pdf', 'html', 'xlsx', 'delivery'];

/** The groups without those in front, as far as anything is left of them. */
export const FOLDED_GROUPS = GROUPS.map(({ title, formats }) => ({
  title,
  formats: formats.filter(({ kind }) => !IN_FRONT.includes(kind)),
})).filter(({ formats }) => formats.length);

/** Formats of other programs that name photos and film: one of them leads a delivery. */
export const DELIVERED = ['en13508', 'en13508xml', 'ribx', 'isybau', 'isybau2024', 'm150'];

/** The act-now sheet. @type {Format} */
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

/** The choices of a delivery: the exchange format, and the language of what people read. */
export const deliveryChoices = () => html`<div class="export__choices stack gap-3" data-part="choices">
  <div class="field"><label for="delivery-exchange">${t('export.exchange_format')}</label>
    <select class="input" id="delivery-exchange" data-part="exchange">${DELIVERED.map(formatOf)
      .filter(Boolean)
      .map(({ kind, name }) => html`<option value="${kind}">${name}</option>`)}</select></div>
  <div class="field"><label for="delivery-language">${t('export.language')}</label>
    <select class="input" id="delivery-language" data-part="lang">${LANGUAGES.map(
      ([code, name]) => html`<option value="${code}" lang="${code}"
      ${code === language && html`selected`}>${name}</option>`,
    )}</select></div></div>`;
