/** The clock position within a code that is being typed. */

import { hoursOf } from '../../../core/defects/code-chain.js';
import { html } from '../../../core/page/html.js';
import { clockRange } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

const HOURS = Array.from({ length: 12 }, (_, i) => i + 1);

/** Returns the position that was typed so far, in words. */
export function clockText(typed) {
  const { clock_from: from, clock_to: to } = hoursOf(typed);
  if (from === null) return t('chain.hour');
  return to === null && typed.endsWith('@') ? t('chain.hour_to', { from }) : clockRange(from, to);
}

/** The key that begins a position; then the hours, and the key for where it ends. */
export function clockMarkup(typed) {
  const isOpen = typed.endsWith('@');
  const isRange = typed.lastIndexOf('@') > 0;
  if (isRange && !isOpen) return null;
  return html`<div class="chain__keys flow gap-1" role="group" aria-label="${t('dial.label')}">
    ${
      isOpen
        ? HOURS.map(
            (hour) =>
              html`<button type="button" class="button button--small number" data-hour="${String(hour).padStart(2, '0')}">${hour}</button>`,
          )
        : html`<button type="button" class="button button--small" data-key="@"><kbd>@</kbd>${typed ? t('chain.clock_to') : t('chain.clock')}</button>`
    }</div>`;
}
