/** Language, units, the codes on the digit keys and the code pack; stored on the server for each person. */

import { ApiError } from '../../../core/server/api.js';
import { Catalogue } from '../../../core/defects/codes.js';
import { html, render } from '../../../core/page/html.js';
import { USUAL_CODES, preferences, quickCodesWith } from '../../../core/page/preferences.js';
import { Component } from '../../../core/page/store.js';
import { LANGUAGES, errorText, t } from '../../../core/page/words.js';
import { codeSearch } from '../../defects/code-search/code-search.js';
import { framedPage } from '../../shared/page-frame/page-frame.js';
import { bindKeysSection, keysMarkup } from './keys-section.js';
import { bindPacksSection, packsMarkup } from './packs-section.js';
import { choiceOfRedraw, redrawWith } from './redraw.js';
import { bindUseSection, useMarkup } from './use-section.js';

export class SettingsPage extends Component {
  mount() {
    /** @type {Parts<'settings-page/settings-page'>} */
    this.parts = render(this, framedPage({ title: t('settings.title'), content: content() }));
    const { parts } = this;
    const report = (text, isFault = false) => {
      parts.message.textContent = text;
      parts.message.classList.toggle('fault', isFault);
    };
    const save = (changes) => attempt(() => preferences.save(changes), report);

    parts.language.value = preferences.value.language ?? '';
    parts.units.value = preferences.value.units;
    this.listen(parts.language, 'change', () => redrawWith({ language: parts.language.value || null }, 'language'));
    this.listen(parts.units, 'change', () => redrawWith({ units: parts.units.value }, 'units'));
    bindKeysSection(parts.singleKeys, save);
    this.listen(parts.usual, 'click', async () => {
      await save({ quick_codes: USUAL_CODES });
      await showQuickCodes(parts, save, report);
    });
    const loadPacks = bindPacksSection(
      parts,
      (run) => attempt(run, report),
      report,
      () => showQuickCodes(parts, save, report),
    );
    bindUseSection(parts, (run) => attempt(run, report));
    parts[choiceOfRedraw() ?? 'none']?.focus();
    attempt(async () => {
      await loadPacks();
      await showQuickCodes(parts, save, report);
    }, report);
  }
}

const content =
  () => html`<div class="settings-page panel stack gap-4 pad-4"><section class="settings stack gap-3" aria-labelledby="settings-display">
    <h2 id="settings-display">${t('settings.display')}</h2>
    <div class="settings__pair stack gap-3 at-bottom">
      <div class="field"><label for="settings-language">${t('settings.language')}</label>
        <select class="input" id="settings-language" data-part="language">
          <option value="">${t('settings.language_auto')}</option>
          ${LANGUAGES.map(([code, name]) => html`<option value="${code}" lang="${code}">${name}</option>`)}
        </select></div>
      <div class="field"><label for="settings-units">${t('settings.units')}</label>
        <select class="input" id="settings-units" data-part="units">
          <option value="m">${t('settings.metres')}</option><option value="ft">${t('settings.feet')}</option>
        </select></div>
    </div>
    <p class="help">${t('settings.theme_help')}</p>
  </section>
  <section class="settings stack gap-3" aria-labelledby="settings-quick">
    <div class="settings__head apart">
      <h2 id="settings-quick">${t('settings.quick')}</h2>
      <button type="button" class="button button--small" data-part="usual">${t('settings.quick_reset')}</button>
    </div>
    <p class="help">${t('settings.quick_help')}</p>
    <ol class="settings__codes" data-part="codes"></ol>
  </section>
  ${keysMarkup()}
  ${useMarkup()}
  ${packsMarkup()}
  <p class="settings__message" role="status" data-part="message"></p></div>`;

/** Runs a request to the server and shows at the foot of the page why it failed. */
async function attempt(run, report) {
  report('');
  try {
    await run();
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    report(errorText(error), true);
  }
}

/**
 * Shows a row for each digit key: the code, found by its letters or by a word, and its meaning.
 * @param {Record<string, any>} parts of the page
 * @param {(changes: object) => void} save
 * @param {(text: string, isFault?: boolean) => void} report
 */
async function showQuickCodes({ codes }, save, report) {
  const catalogue = await Catalogue.load(undefined, preferences.value.pack);
  const rows = render(codes, html`${USUAL_CODES.map((_, i) => quickRow(i))}`);
  USUAL_CODES.forEach((usual, i) => {
    const [input, list, label] = ['input', 'list', 'label'].map((part) => rows[`${part}${i}`]);
    const show = () => {
      const { code, char1, char2 } = preferences.value.quick_codes[i] ?? usual;
      input.value = [code, char1, char2].filter(Boolean).join(' ');
      label.textContent = catalogue.has(code) ? catalogue.label(code, char1, char2) : t('settings.quick_unknown');
    };
    const choose = ({ code, char1, char2 }) => {
      save({ quick_codes: quickCodesWith(i, { code, char1: char1 || null, char2: char2 || null }) });
      show(); // at once: the person may be typing another code when the answer comes
    };
    codeSearch(input, list, catalogue, choose);
    // A typed code counts when the field is left; an unknown one is reported first.
    input.addEventListener('change', () => {
      const row = catalogue.typed(input.value);
      if (row) choose(row);
      else report(t('code.not_found', { text: input.value.trim() }), true);
    });
    input.addEventListener('blur', show);
    show();
  });
}

function quickRow(i) {
  const key = i + 1;
  return html`<li class="settings__code stack holds">
    <label for="quick-${key}"><kbd>${key}</kbd><span class="visually-hidden">${t('settings.quick_key', { key })}</span></label>
    <input class="input" id="quick-${key}" role="combobox" aria-autocomplete="list" aria-expanded="false"
      aria-controls="quick-${key}-codes" aria-describedby="quick-${key}-label" autocomplete="off" spellcheck="false"
      data-part="input${i}" />
    <ul class="code-search__list panel" id="quick-${key}-codes" role="listbox"
      aria-label="${t('settings.quick_codes', { key })}" data-part="list${i}" hidden></ul>
    <span class="help" id="quick-${key}-label" data-part="label${i}"></span>
  </li>`;
}

customElements.define('settings-page', SettingsPage);
