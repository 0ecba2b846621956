/** Shows the page that belongs to the address. */

import { session } from './core/server/api.js';
import { keepPage } from './core/page/kept-page.js';
import { isKeyOn } from './core/page/keys.js';
import { preferences } from './core/page/preferences.js';
import { keepPresses } from './core/page/presses.js';
import { may } from './core/page/rights.js';
import { t } from './core/page/words.js';
import { showInsecure } from './components/shared/insecure-banner/insecure-banner.js';
import { showKept } from './components/shared/kept-banner/kept-banner.js';
import { toastError } from './components/shared/toast-stack/toast-stack.js';
import './components/films/add-films/add-films.js';
import './components/assets/assets-page/assets-page.js';
import './components/find/find-page/find-page.js';
import './components/films/failures-page/failures-page.js';
import './components/films/films-page/films-page.js';
import './components/assets/map-page/map-page.js';
import './components/assets/asset-map/asset-map.js';
import './components/assets/projects-page/projects-page.js';
import './components/films/quality-page/quality-page.js';
import './components/assets/register-page/register-page.js';
import './components/films/rules-page/rules-page.js';
import './components/desk/compare/compare-page.js';
import './components/inspections/inspection-list/inspection-list.js';
import './components/intake/new-inspection/new-inspection.js';
import './components/reports/report-template/report-template.js';
import './components/settings/access-page/access-page.js';
import './components/settings/detectors-page/detectors-page.js';
import './components/settings/settings-page/settings-page.js';
import './components/work/work-page/work-page.js';
import './components/desk/page/inspection-page.js';

/** @type {[RegExp, string][]} path, element */
const PAGES = [
  [/^\/$/, 'work-page'],
  [/^\/inspections$/, 'inspection-list'],
  [/^\/inspections\/([0-9a-f-]+)\/?$/, 'inspection-page'],
  [/^\/new$/, 'new-inspection'],
  [/^\/compare$/, 'compare-page'],
  [/^\/assets$/, 'assets-page'],
  [/^\/assets\/map$/, 'map-page'],
  [/^\/assets\/register$/, 'register-page'],
  [/^\/assets\/projects$/, 'projects-page'],
  [/^\/find$/, 'find-page'],
  [/^\/films$/, 'films-page'],
  [/^\/films\/add$/, 'add-films'],
  [/^\/films\/failures$/, 'failures-page'],
  [/^\/films\/rules$/, 'rules-page'],
  [/^\/films\/quality$/, 'quality-page'],
  [/^\/settings$/, 'settings-page'],
  [/^\/settings\/access$/, 'access-page'],
  [/^\/settings\/detectors$/, 'detectors-page'],
  [/^\/settings\/template$/, 'report-template'],
];

session.addEventListener('signed-out', () => {
  location.assign(`/login?next=${encodeURIComponent(location.pathname + location.search)}`);
});

// A fault in the page itself must not go unnoticed; a request that ended with its element is none.
addEventListener('unhandledrejection', (event) => {
  if (event.reason?.name === 'AbortError') event.preventDefault();
  else toastError(event.reason);
});
addEventListener('error', ({ error, message }) => toastError(error ?? new Error(message)));

keepPresses();
document.documentElement.classList.toggle('without-single-keys', !isKeyOn('a'));
const [, name] = PAGES.find(([pattern]) => pattern.test(location.pathname)) ?? PAGES[0];
// For style sheets: `:has()` on the root would search the whole page at every change of a text.
document.documentElement.dataset.page = name;
const page = Object.assign(document.createElement(name), { inspectionId: location.pathname.split('/')[2] });
document.querySelector('.skip').textContent = t('page.skip');
document.body.insertBefore(page, document.querySelector('toast-stack'));
if (!may('operator')) {
  const note = document.createElement('aside');
  note.className = 'banner';
  note.textContent = t('rights.viewer');
  page.before(note);
}
showInsecure();
showKept();
keepPage();

// Changed on another device: every word and number of the page may change.
if (await preferences.load()) location.reload();
