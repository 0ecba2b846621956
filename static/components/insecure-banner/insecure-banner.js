/** The warning on top of every page of a server that other machines reach without encryption. */

import { html, render } from '../../core/html.js';
import { isInsecure } from '../../core/rights.js';
import { t } from '../../core/words.js';

/** Puts it above the page where it has to be. */
export function showInsecure() {
  if (!isInsecure) return;
  const banner = document.createElement('p');
  banner.className = 'banner banner--insecure';
  banner.setAttribute('role', 'alert');
  render(banner, html`${t('page.insecure')}`);
  document.body.prepend(banner);
}
