/** The form of one asset of the register, as a dialog. */

import { get } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { lineText, loadAsset, readLine, saveAsset } from '../../../core/survey/register.js';
import { t } from '../../../core/page/words.js';
import '../asset-note/asset-note.js';
import { formFoot, openDialog, orFault } from '../../shared/dialog/dialog.js';
import { fieldMarkup, read, written } from '../../desk/header/fields.js';

/** The fields by subject, in the order of the form. @type {[string, string[]][]} */
const GROUPS = [
  [
    t('register.group_barrel'),
    ['asset_type', 'shape', 'height_mm', 'width_mm', 'material', 'lining_type', 'lining_material', 'year'],
  ],
  [t('register.group_lengths'), ['known_length_m', 'known_length_source', 'expected_length_m', 'unit_length_m']],
  [t('register.group_network'), ['start_node', 'end_node', 'upstream_node', 'downstream_node', 'client']],
  [t('register.group_place'), ['road', 'road_chainage', 'road_chainage_end', 'location_text']],
];

/**
 * Opens the form of an asset, of a new one where the register has none of this id, and saves it.
 * @param {string} [assetId]
 * @returns {Promise<import('../../../core/survey/register.js').Asset|null>} the saved asset; null: it was dismissed
 */
export async function editAsset(assetId = '') {
  const [{ fields }, stored] = await Promise.all([
    get('/api/header-fields'),
    assetId === '' ? null : loadAsset(assetId),
  ]);
  const known = stored ?? { asset_id: assetId, project: null, header: {}, line: [] };
  const byName = new Map(fields.map((field) => [field.name, field]));
  const { dialog, parts, closed } = openDialog({
    title: stored ? known.asset_id : t('register.add'),
    content: formMarkup(known, stored !== null, byName),
    size: 'wide',
    question: () =>
      allTyped() === begun
        ? null
        : { title: t('register.leave_title'), text: t('register.leave_text'), submit: t('register.leave') },
  });
  const allTyped = () => JSON.stringify([...parts.form.elements].map(({ value }) => value));
  const inputs = [...parts.form.querySelectorAll('[data-field]')].map((input) => ({
    input,
    field: byName.get(input.dataset.field),
  }));
  const shownOf = (field) => written(field, known.header[field.name] ?? null);
  for (const { input, field } of inputs) input.value = shownOf(field);
  parts.line.value = lineText(known.line);
  const begun = allTyped();
  if (!stored) {
    parts.note.follow(parts.id);
    parts.note.addEventListener('looked', ({ detail }) =>
      show(parts.id, detail.fields === null ? '' : t('register.exists', { id: detail.assetId })),
    );
  }
  (stored ? parts.project : parts.id).focus();

  /** Returns the header as typed, null where a field has a fault, which is shown. */
  const typed = () => {
    /** @type {Record<string, unknown>} */
    const header = {};
    for (const { input, field } of inputs) {
      // An untouched length stays as precise as it is.
      const isSame = input.value === shownOf(field);
      const value = isSame ? (known.header[field.name] ?? null) : read(field, input.value);
      show(input, value === undefined ? t('header.fault_number') : '');
      if (value === undefined) return null;
      if (value !== null) header[field.name] = value;
    }
    return header;
  };

  let saved = null;
  const save = async () => {
    const id = parts.id.value.trim();
    show(parts.id, id === '' ? t('page.needed') : '');
    const header = id === '' ? null : typed();
    const { line, fault } = readLine(parts.line.value);
    show(parts.line, fault === null ? '' : t('register.line_fault', { row: fault }));
    if (header === null || fault !== null) return;
    if (!stored && (await loadAsset(id))) {
      show(parts.id, t('register.exists', { id }));
      return;
    }
    const asset = { asset_id: id, project: parts.project.value.trim() || null, header, line };
    saved = await saveAsset(asset, stored?.version);
    dialog.close();
  };

  parts.form.addEventListener('submit', async (event) => {
    event.preventDefault();
    await orFault(parts, save);
    parts.form.querySelector('[aria-invalid="true"]')?.focus();
  });
  await closed;
  return saved;
}

/** Shows a fault beside a field; '' removes it. */
function show(input, sentence) {
  input.setAttribute('aria-invalid', String(sentence !== ''));
  input.closest('.field').querySelector('.fault').textContent = sentence;
}

function formMarkup({ asset_id: id, project }, isStored, byName) {
  return html`<form class="stack gap-4" data-part="form" novalidate>
    <div class="asset-form__grid stack at-top">
      <div class="field"><label for="asset-id">${t('header.asset_id')}</label>
        <input class="input" id="asset-id" maxlength="200" autocomplete="off" spellcheck="false" value="${id}" ${isStored && 'readonly'}
          aria-describedby="asset-id-fault" data-part="id" />
        <span class="fault" id="asset-id-fault" role="alert"></span></div>
      <asset-note data-part="note"></asset-note>
      <div class="field"><label for="asset-project">${t('archive.project')}</label>
        <input class="input" id="asset-project" maxlength="200" autocomplete="off" value="${project ?? ''}" data-part="project" /></div>
    </div>
    ${GROUPS.map(
      ([title, names]) => html`<fieldset class="asset-form__group"><legend>${title}</legend>
      <div class="asset-form__grid stack at-top">${names.map((name) => fieldMarkup(byName.get(name)))}</div></fieldset>`,
    )}
    <div class="field"><label for="asset-line">${t('register.line')}</label>
      <textarea class="input asset-form__line pad-row mono" id="asset-line" rows="3" spellcheck="false" autocomplete="off"
        aria-describedby="asset-line-help asset-line-fault" data-part="line"></textarea>
      <span class="fault" id="asset-line-fault"></span>
      <span class="help" id="asset-line-help">${t('register.line_help')}</span></div>
    ${formFoot(t('register.save'))}</form>`;
}
