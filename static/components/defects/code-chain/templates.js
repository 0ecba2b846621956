/** Codes with all their details, kept beyond the nine digit keys: each has a letter of the list. */

import { html } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { quickLabel } from '../../film/video/quick-codes.js';

/** One letter for each template. */
export const TEMPLATE_KEYS = [...'ABCDEFGHIJKLMNOPQRSTUVWXYZ'];

/** @param {import('../../../core/defects/codes.js').Catalogue} catalogue */
export function templatesMarkup(catalogue) {
  const { templates } = preferences.value;
  if (templates.length === 0) return html`<p class="chain__code">${t('chain.no_templates')}</p>`;
  return html`<ul class="chain__templates stack gap-1" aria-label="${t('chain.templates')}">${templates.map(
    (tag, i) => html`<li class="row gap-0 shrinks">
    <button type="button" class="button button--small one-line grow shrinks" data-key="${TEMPLATE_KEYS[i]}"><kbd>${TEMPLATE_KEYS[i]}</kbd><b>${tag.code}</b>
      ${quickLabel(catalogue, tag)}</button>
    <button type="button" class="button button--quiet button--small button--icon" data-forget="${i}" title="${t('chain.forget')}"
      aria-label="${t('chain.forget')}: ${quickLabel(catalogue, tag)}">${icon('trash')}</button></li>`,
  )}</ul>`;
}
