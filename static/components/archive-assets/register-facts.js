/** What the register of assets says of one. */

import { ApiError, get } from '../../core/api.js';
import { html } from '../../core/html.js';
import { t, wordFor } from '../../core/words.js';
import { valueText } from '../history-panel/differences.js';

/** Returns the facts of a registered asset, or that there are none. */
export async function registerFacts(asset, signal) {
  try {
    const { project, header } = await get(`/api/register/assets/${encodeURIComponent(asset)}`, signal);
    const facts = Object.entries(header).map(([name, value]) => [wordFor('header', name) ?? name, valueText(name, value)]);
    if (project) facts.unshift([t('archive.project'), project]);
    return html`<dl class="asset__register">${facts.map(([name, value]) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>`;
  } catch (error) {
    if (!(error instanceof ApiError) || error.status !== 404) throw error;
    return html`<p class="dim">${t('assets.unregistered')}</p>`;
  }
}
