/** What the register of assets says of one. */

import { ApiError, get } from '../../core/api.js';
import { html } from '../../core/html.js';
import { t } from '../../core/words.js';
import { factsMarkup } from '../archive-shell/archive-shell.js';
import { labelOf, valueText } from '../history-panel/differences.js';

const factText = (name, value) => (name.endsWith('_mm') ? `${value} mm` : valueText(name, value));

/** Returns the facts of a registered asset, or that there are none. */
export async function registerFacts(asset, signal) {
  try {
    const { project, header } = await get(`/api/register/assets/${encodeURIComponent(asset)}`, signal);
    const facts = Object.entries(header).map(([name, value]) => [labelOf(name), factText(name, value)]);
    if (project) facts.unshift([t('archive.project'), project]);
    return factsMarkup(facts);
  } catch (error) {
    if (!(error instanceof ApiError) || error.status !== 404) throw error;
    return html`<p class="dim">${t('assets.unregistered')}</p>`;
  }
}
