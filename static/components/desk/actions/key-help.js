/** The list of all keys, in a dialog: to read, to print, and, where the page allows it, to change one by one. */

import { html, render } from '../../../core/page/html.js';
import { isKeyOn, keyFor, keyName, shownKey } from '../../../core/page/keys.js';
import { preferences } from '../../../core/page/preferences.js';
import { t } from '../../../core/page/words.js';
import { openDialog, orFault } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/** Keys that the browser, a dialog or the codes need: nothing else is put on them. */
const RESERVED = /^(Ctrl\+|Shift\+)*(Tab|Enter|Escape|Dead|Process|Unidentified|\d)$/;
const MODIFIERS = ['Shift', 'Control', 'Alt', 'AltGraph', 'Meta', 'CapsLock'];

/** @typedef {{title: string, bindings: import('../../../core/page/keys.js').Binding[]}[]} Groups */

/**
 * @param {Groups} groups
 * @param {{hasStage?: boolean, isChangeable?: boolean}} [page] hasStage: whether the page has a picture and strips
 */
export async function showKeys(groups, { hasStage = true, isChangeable = false } = {}) {
  const before = JSON.stringify(preferences.value.keys);
  const opened = openDialog({
    title: t('keys.title'),
    size: 'wide',
    content: html`${!isKeyOn('a') && html`<p class="message">${t('keys.singles_off')}</p>`}
      <div class="key-help__ways row wrap">
        ${isChangeable && html`<p class="help grow">${t('keys.change_help')}</p>`}<span class="grow"></span>
        ${isChangeable && html`<button type="button" class="button button--small" data-part="usual">${icon('undo')}${t('keys.usual')}</button>`}
        <button type="button" class="button button--small" data-part="print">${icon('download')}${t('keys.print')}</button></div>
      <p class="fault" role="alert" data-part="fault"></p>
      <div class="key-help"><div data-part="groups"></div>${hasStage && pointerMarkup()}</div>`,
  });
  const { dialog, parts, closed } = opened;
  dialog.classList.add('dialog--sheet');
  const show = () => {
    render(
      parts.groups,
      html`${groups
        .map(withoutOff)
        .filter(({ bindings }) => bindings.length)
        .map((group) => groupMarkup(group, isChangeable))}`,
    );
    if (parts.usual) parts.usual.disabled = Object.keys(preferences.value.keys).length === 0;
  };
  const keep = (keys) =>
    orFault(parts, async () => {
      await preferences.save({ keys });
      show();
    });
  parts.print.addEventListener('click', () => print());
  parts.usual?.addEventListener('click', () => keep({}));
  parts.groups.addEventListener('click', ({ target }) => {
    const button = target.closest('[data-usual]');
    if (button) change(button, groups, parts, keep, show);
  });
  show();
  await closed;
  // Every button of the page names its key.
  if (JSON.stringify(preferences.value.keys) !== before) location.reload();
}

/** Waits for the key that a person wants in place of a usual one, and says what stands against it. */
function change(button, groups, parts, keep, show) {
  const { usual } = button.dataset;
  button.textContent = t('keys.press');
  parts.fault.textContent = '';
  const end = new AbortController();
  const leave = () => {
    end.abort();
    show();
    parts.groups.querySelector(`[data-usual="${CSS.escape(usual)}"]`)?.focus();
  };
  const press = async (event) => {
    if (MODIFIERS.includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    const key = keyName(event);
    const taken = bindingOf(groups, key, usual);
    if (event.key !== 'Escape' && (event.altKey || RESERVED.test(key)))
      parts.fault.textContent = t('keys.reserved', { key: shownKey(key) });
    else if (event.key !== 'Escape' && taken)
      parts.fault.textContent = t('keys.taken', { key: shownKey(key), what: taken.label ?? '' });
    else if (event.key !== 'Escape') {
      const { [usual]: _, ...others } = preferences.value.keys;
      await keep(key === usual ? others : { ...others, [usual]: key });
    }
    leave();
  };
  button.addEventListener('keydown', press, { signal: end.signal });
  button.addEventListener('blur', leave, { signal: end.signal });
}

/** What is on a key already, beside the action of a usual key. @param {Groups} groups */
const bindingOf = (groups, key, usual) =>
  groups
    .flatMap(({ bindings }) => bindings)
    .find(({ keys }) => keys.some((other) => other !== usual && keyFor(other) === key));

const pointerMarkup = () => html`<section><h3>${t('keys.pointer')}</h3><dl>
  <div><dt>${t('keys.picture')}</dt><dd>${t('keys.picture_help')}</dd></div>
  <div><dt>${t('ask.label')}</dt><dd>${t('keys.ask_help')}</dd></div>
  <div><dt>${t('keys.strip')}</dt><dd>${t('keys.strip_help')}</dd></div>
  <div><dt>${t('keys.zoom')}</dt><dd>${t('keys.zoom_help')}</dd></div>
  <div><dt>${t('keys.wall')}</dt><dd>${t('keys.wall_help')}</dd></div>
  <div><dt>${t('keys.view')}</dt><dd>${t('keys.view_help')}</dd></div>
</dl></section>`;

const withoutOff = ({ title, bindings }) => ({
  title,
  bindings: bindings.filter(({ keys }) => keys.map(keyFor).some(isKeyOn)),
});

const groupMarkup = ({ title, bindings }, isChangeable) =>
  html`<section><h3>${title}</h3><dl>${bindings.map((binding) => row(binding, isChangeable))}</dl></section>`;

/** What is typed as a code, or has a key for each of several things, stays where it is. */
function row({ keys, shown, label }, isChangeable) {
  const isFixed = !isChangeable || shown !== undefined || keys.some((key) => RESERVED.test(key));
  const marks = shown
    ? shown.filter(isKeyOn).map((key) => html`<kbd>${key}</kbd>`)
    : keys.filter((key) => isKeyOn(keyFor(key))).map((usual) => keyMarkup(usual, label, isFixed));
  return html`<div><dt>${marks.map((mark, i) => html`${i > 0 && t('keys.or')}${mark}`)}</dt><dd>${label}</dd></div>`;
}

const keyMarkup = (usual, label, isFixed) => {
  const key = shownKey(keyFor(usual));
  return isFixed
    ? html`<kbd>${key}</kbd>`
    : html`<button type="button" class="bare key-help__key" data-usual="${usual}" aria-label="${t('keys.change', { key, what: label })}"><kbd>${key}</kbd></button>`;
};
