/** The library of rigs in a dialog: take one, keep the present one, rename, save as a file, delete. */

import { ApiError, get, put, remove } from '../../../core/server/api.js';
import { save } from '../../../core/survey/exports.js';
import { html, render, setText } from '../../../core/page/html.js';
import { newId } from '../../../core/page/new-id.js';
import { count, date } from '../../../core/wall/units.js';
import { errorText, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

const USERS_SHOWN = 5;

/**
 * @param {object|null} present the rig of the form, which can be kept; null if it has faults
 * @param {string} name under which it was taken from the library, or ''
 * @returns {Promise<{name: string, rig: object}|null>} what was taken or kept; null: neither
 */
export async function openRigLibrary(present, name) {
  const { dialog, parts, closed } = openDialog({
    title: t('library.title'),
    content: html`<form class="library__keep flow gap-3 at-bottom" data-part="form" novalidate>
        <div class="field"><label for="library-name">${t('library.keep_as')}</label>
          <input class="input" id="library-name" maxlength="100" autocomplete="off" value="${name}"
            aria-describedby="library-fault" data-part="name" /></div>
        <button class="button button--primary" data-part="keep">${t('library.keep')}</button>
      </form>
      <p class="fault" id="library-fault" role="alert" data-part="fault"></p>
      <div role="status" data-part="said"></div>
      <ul class="library stack gap-3" data-part="list"></ul>`,
    size: 'wide',
  });
  parts.form.hidden = present === null;
  let rigs = [];
  let taken = null;

  const finish = ({ name: of, rig }) => {
    taken = { name: of, rig };
    dialog.close();
  };
  const named = () => rigs.find((each) => each.name === parts.name.value.trim());
  const showKeep = () => setText(parts.keep, named() ? t('library.replace') : t('library.keep'));

  /** Does something on the server; shows why it failed, or what is there now. Returns whether it was done. */
  const act = async (change) => {
    parts.fault.textContent = '';
    render(parts.said, html``);
    let isDone = true;
    try {
      await change();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      parts.fault.textContent = errorText(error);
      isDone = false;
    }
    if (isDone) await show();
    return isDone;
  };
  const keepAs = (each, as) => put(`/api/rigs/${each.id}`, { name: as, rig: each.rig });

  const drop = async (each) => {
    if (!(await act(() => remove(`/api/rigs/${each.id}`)))) return;
    const { back } = render(
      parts.said,
      html`<p class="message">${t('library.deleted', { name: each.name })}
        <button type="button" class="button button--small" data-part="back">${icon('undo')}${t('page.undo')}</button></p>`,
    );
    back.addEventListener('click', () => act(() => keepAs(each, each.name)));
    back.focus();
  };

  const show = async () => {
    ({ rigs } = await get('/api/rigs'));
    render(parts.list, rigs.length ? html`${rigs.map(row)}` : html`<li class="help">${t('library.empty')}</li>`);
    showKeep();
  };

  parts.list.addEventListener('click', ({ target }) => {
    const button = target.closest('[data-act]');
    const each = button && rigs.find(({ id }) => id === button.closest('li').dataset.id);
    if (!each) return;
    if (button.dataset.act === 'take') finish(each);
    else if (button.dataset.act === 'file') save(fileOf(each));
    else drop(each);
  });
  parts.list.addEventListener('change', async ({ target }) => {
    const each = rigs.find(({ id }) => id === target.closest('li').dataset.id);
    if (!(await act(() => keepAs(each, target.value.trim())))) target.value = each.name;
  });
  parts.name.addEventListener('input', showKeep);
  parts.form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const as = parts.name.value.trim();
    parts.fault.textContent = as ? '' : t('page.needed');
    if (!as) return;
    const kept = { id: named()?.id ?? newId(), rig: present };
    if (await act(() => keepAs(kept, as))) finish({ name: as, rig: present });
  });
  await act(async () => {});
  await closed;
  return taken;
}

/** Returns the rig as the file that "Load rig.json" and the commands read. */
const fileOf = ({ name, rig }) =>
  new File([JSON.stringify(rig, null, 2)], `${name.replace(/[^\p{L}\p{N}._-]+/gu, '_')}.rig.json`, {
    type: 'application/json',
  });

const row = ({
  id,
  name,
  changed_at: at,
  changed_by: by,
  used_by: users,
}) => html`<li class="library__rig one-if-narrow stack gap-row framed pad-3" data-id="${id}">
  <input class="input" maxlength="100" autocomplete="off" aria-label="${t('library.name_of', { name })}" value="${name}" />
  <span class="flow">
    <button type="button" class="button button--small button--primary" data-act="take"
      aria-label="${t('library.take_named', { name })}">${icon('check')}${t('library.take')}</button>
    <button type="button" class="button button--small" data-act="file"
      aria-label="${t('library.file_named', { name })}">${icon('download')}${t('library.file')}</button>
    <button type="button" class="button button--small" data-act="delete"
      aria-label="${t('library.delete_named', { name })}">${icon('trash')}${t('library.delete')}</button>
  </span>
  <span class="help whole-row">${t('library.changed', { by, date: date(at) })}
    ${t('library.used_by', { n: users.length, count: count(users.length) })}
    ${users.slice(0, USERS_SHOWN).map((user) => html` <a href="/inspections/${user.id}">${user.name}</a>`)}</span></li>`;
