/** What the register of assets says of one, beside its project. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { factsMarkup } from '../../shared/page-frame/page-frame.js';
import { labelOf, valueText } from '../../desk/panels/differences.js';

/** @param {import('../../../core/survey/register.js').Asset|null} registered null if the register does not have it */
export function registerFacts(registered) {
  if (registered === null) return html`<p class="dim">${t('assets.unregistered')}</p>`;
  return factsMarkup(Object.entries(registered.header).map(([name, value]) => [labelOf(name), factText(name, value)]));
}

const factText = (name, value) => (name.endsWith('_mm') ? `${value} mm` : valueText(name, value));
