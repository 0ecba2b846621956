/** The code packs: that of new inspections, all versions with their project and use, import, template. */

import { get, remove } from '../../../core/server/api.js';
import { offered } from '../../../core/defects/packs.js';
import { html, render } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { may } from '../../../core/page/rights.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { importPack } from './import-pack.js';

export const packsMarkup = () => html`<section class="settings stack gap-3" aria-labelledby="settings-packs">
    <h2 id="settings-packs">${t('settings.packs')}</h2>
    <div class="settings__pair stack gap-3 at-bottom">
      <div class="field"><label for="settings-pack">${t('settings.pack')}</label>
        <select class="input" id="settings-pack" data-part="pack"></select></div>
      <div class="settings__buttons">
        <button type="button" class="button" data-part="pick" ${!may('admin') && 'disabled'}>${icon('upload')}${t('settings.pack_import')}</button>
        <a class="button" href="/api/packs/template.xlsx" download>${icon('download')}${t('settings.pack_template')}</a>
      </div>
    </div>
    <ul class="stack" data-part="packs" aria-label="${t('settings.packs')}"></ul>
    <p class="help">${t('settings.packs_help')} ${!may('admin') && t('rights.admin')}</p>
  </section>`;

/**
 * @param {Record<string, any>} parts of the page
 * @param {(run: () => Promise<void>) => Promise<void>} attempt says on the page what the server refuses
 * @param {(text: string) => void} report
 * @param {() => Promise<void>} onChosen another pack is that of new inspections
 */
export function bindPacksSection({ pack, pick, packs: list }, attempt, report, onChosen) {
  /** @type {import('../../../core/defects/packs.js').Pack[]} */
  let known = [];
  const load = async () => {
    ({ packs: known } = await get('/api/packs'));
    const { pack: chosen } = preferences.value;
    render(
      pack,
      html`<option value="">${t('settings.pack_built_in')}</option>
        ${known
          .filter((one) => one.id === chosen || one.project !== null || offered(known, null).includes(one))
          .map(({ id, name }) => html`<option value="${id}">${name}</option>`)}`,
    );
    pack.value = chosen ?? '';
    render(list, html`${known.map(packMarkup)}`);
  };
  const choose = async (id) => {
    await preferences.save({ pack: id });
    await onChosen();
  };
  pack.addEventListener('change', () => attempt(() => choose(pack.value || null)));
  pick.addEventListener('click', () =>
    attempt(async () => {
      const name = await importPack(known);
      if (name === null) return;
      await load();
      pick.focus();
      report(t('settings.pack_imported', { name }));
    }),
  );
  list.addEventListener('click', ({ target }) => {
    const id = target.closest('[data-delete]')?.dataset.delete;
    if (!id) return;
    attempt(async () => {
      await remove(`/api/packs/${id}`);
      if (preferences.value.pack === id) await choose(null);
      const { name } = /** @type {{name: string}} */ (known.find((one) => one.id === id));
      await load();
      pack.focus();
      report(t('settings.pack_deleted', { name }));
    });
  });
  return load;
}

/** @param {import('../../../core/defects/packs.js').Pack} pack */
function packMarkup({ id, name, project, codes, ratings, inspections }) {
  const facts = [
    t('settings.pack_is', { codes, ratings }),
    project === null ? t('settings.pack_of_all') : t('settings.pack_of_project', { project }),
    inspections ? t('settings.pack_used', { n: inspections }) : t('settings.pack_unused'),
  ];
  const label = t('settings.pack_delete', { name });
  return html`<li class="row apart gap-3"><span class="shrinks"><b>${name}</b> <span class="dim">${facts.join(' · ')}</span></span>
    ${may('admin') && html`<button type="button" class="button button--quiet button--small button--icon" data-delete="${id}" title="${label}" aria-label="${label}" ${inspections > 0 && 'disabled'}>${icon('trash')}</button>`}</li>`;
}
