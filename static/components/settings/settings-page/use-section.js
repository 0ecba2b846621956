/** How exact distances must be to be of use, for everyone on the server; admins change it. */

import { get, put } from '../../../core/server/api.js';
import { html } from '../../../core/page/html.js';
import { rounded } from '../../../core/wall/rounding.js';
import { lengthUnit, parseDistance, toShown } from '../../../core/wall/units.js';
import { may } from '../../../core/page/rights.js';
import { t } from '../../../core/page/words.js';

const field = (name, label, unit) => html`<div class="field"><label for="settings-use-${name}">${label}</label>
    <span class="input-with-unit"><input class="input" id="settings-use-${name}" inputmode="decimal" autocomplete="off"
      aria-describedby="settings-use-help" data-part="use_${name}" disabled /><span class="unit">${unit}</span></span></div>`;

export const useMarkup = () => html`<section class="settings stack gap-3" aria-labelledby="settings-use">
    <h2 id="settings-use">${t('settings.use')}</h2>
    <div class="settings__pair stack gap-3 at-bottom">
      ${field('within', t('settings.use_within'), lengthUnit)} ${field('percent', t('settings.use_percent'), '%')}
    </div>
    <p class="help" id="settings-use-help">${t('settings.use_help')} ${!may('admin') && t('rights.admin')}</p>
  </section>`;

/**
 * Shows what is stated, and states what is entered.
 * @param {Record<string, any>} parts of the page
 * @param {(run: () => Promise<void>) => Promise<void>} attempt says on the page what the server refuses
 */
export function bindUseSection({ use_within: within, use_percent: percent }, attempt) {
  /** @param {Api['IntendedUseIn']} use */
  const show = (use) => {
    within.value = String(rounded(toShown(use.within_m), 2));
    percent.value = String(use.percent);
  };
  const state = async () => {
    const [m, share] = [parseDistance(within.value), Number(percent.value.replace(',', '.'))];
    within.setAttribute('aria-invalid', String(!(m > 0)));
    percent.setAttribute('aria-invalid', String(!(share >= 0 && share <= 100)));
    if (m > 0 && share >= 0 && share <= 100) {
      await attempt(() => put('/api/intended-use', { within_m: rounded(m, 4), percent: share }));
    }
  };
  attempt(async () => {
    show(await get('/api/intended-use'));
    within.disabled = percent.disabled = !may('admin');
  });
  for (const input of [within, percent]) input.addEventListener('change', state);
}
