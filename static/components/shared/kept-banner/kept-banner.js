/** Reports that the page was opened without the server, and when that is back. */

import { get, keptSince, poll } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { date } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';

/** Shows the banner above a page that was opened from what this browser has kept. */
export function showKept() {
  if (keptSince === undefined) return;
  const banner = document.createElement('p');
  banner.className = 'banner';
  banner.setAttribute('role', 'status');
  render(banner, html`${t('kept.offline', { when: date(keptSince) })}`);
  document.body.prepend(banner);
  const until = new AbortController();
  poll(
    async () => {
      await get('/healthz');
      render(
        banner,
        html`${t('kept.is_back')} <button class="button button--small" data-part="reload">${t('kept.reload')}</button>`,
      ).reload.addEventListener('click', () => location.reload());
      return null;
    },
    until.signal,
    () => {},
  );
}
