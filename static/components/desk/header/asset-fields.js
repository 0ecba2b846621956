/** Fills empty fields of a header form from the register of assets, and takes them back. */

import { lacking } from '../../../core/survey/register.js';
import { t, wordFor } from '../../../core/page/words.js';

/**
 * @param {import('./header-form.js').HeaderForm} form
 * @param {import('../../assets/asset-note/asset-note.js').AssetNote} note below the field of the id
 */
export function fillFromRegister(form, note) {
  /** What was filled in for the present id, by field: its value, and the one before. */
  let filled = new Map();
  let filledFor = null;

  /** Values before the filling, of fields that nobody has changed since. */
  const before = () =>
    Object.fromEntries(
      [...filled].filter(([name, { value }]) => form.all[name] === value).map(([name, each]) => [name, each.before]),
    );

  const undo = () => {
    form.state(before());
    filled = new Map();
    note.showFilled([], undo);
  };

  note.addEventListener('looked', (/** @type {CustomEvent} */ { detail: { assetId, fields } }) => {
    // Not while the person is typing: the id counts when the field is left.
    if ((form.all.asset_id ?? '') !== assetId || assetId === filledFor) return;
    filledFor = assetId;
    const back = before();
    // A suggestion, such as the rig's diameter, gives way like an empty field.
    const added = lacking(fields ?? {}, { ...form.entered, ...back });
    const were = { ...form.all, ...back };
    filled = new Map(Object.entries(added).map(([name, value]) => [name, { value, before: were[name] ?? null }]));
    form.state({ ...back, ...added });
    note.showFilled([...new Set(Object.keys(added).map(nameOf))], undo);
  });
}

/** What a person calls a field; the four coordinates are one thing. */
function nameOf(field) {
  if (/_(lat|lon)$/.test(field)) return t('register.position');
  return wordFor('header', field);
}
