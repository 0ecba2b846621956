/** The warning on top of every page of a server that other machines reach without encryption. */

import { html, render } from '../../../core/page/html.js';
import { isInsecure } from '../../../core/page/rights.js';
import { t } from '../../../core/page/words.js';

/** Shows the banner above the page where it is needed. */
export function showInsecure() {
  if (!isInsecure) return;
  const banner = document.createElement('p');
  banner.className = 'banner banner--insecure';
  banner.setAttribute('role', 'alert');
  render(banner, html`${t('page.insecure')}`);
  document.body.prepend(banner);
}
