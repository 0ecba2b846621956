/** The switch for letters, digits and signs as keys: speech input and scanners type them (WCAG 2.1.4). */

import { html } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { t } from '../../../core/page/words.js';

export const keysMarkup = () => html`<section class="settings stack gap-3" aria-labelledby="settings-keys">
    <h2 id="settings-keys">${t('settings.keys')}</h2>
    <label class="settings__switch row gap-3"><input type="checkbox" aria-describedby="settings-keys-help" data-part="singleKeys" />
      ${t('settings.single_keys')}</label>
    <p class="help" id="settings-keys-help">${t('settings.single_keys_help')}</p>
  </section>`;

/**
 * @param {HTMLInputElement} box
 * @param {(changes: Partial<import('../../../core/page/preferences.js').Chosen>) => Promise<void>} save
 */
export function bindKeysSection(box, save) {
  box.checked = preferences.value.single_keys;
  box.addEventListener('change', () => save({ single_keys: box.checked }));
}
