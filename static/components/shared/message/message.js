/** Messages that stay in the page, beside what they are about. */

import { html } from '../../../core/page/html.js';
import { icon } from '../icon/icon.js';

/**
 * @param {'info'|'warning'|'error'} kind
 * @param {string} text
 */
export const message = (kind, text) =>
  html`<p class="message message--${kind}">${icon(kind === 'info' ? 'info' : 'alert')}<span>${text}</span></p>`;
