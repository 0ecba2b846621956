/** Shows the page that belongs to the address. */

import { session } from './core/api.js';
import { keepPage } from './core/kept-page.js';
import { isKeyOn } from './core/keys.js';
import { preferences } from './core/preferences.js';
import { keepPresses } from './core/presses.js';
import { may } from './core/rights.js';
import { t } from './core/words.js';
import { showInsecure } from './components/insecure-banner/insecure-banner.js';
import { showKept } from './components/kept-banner/kept-banner.js';
import { reopenSettings } from './components/settings-dialog/settings-dialog.js';
import { toastError } from './components/toast-stack/toast-stack.js';
import './components/archive-add/archive-add.js';
import './components/archive-assets/archive-assets.js';
import './components/archive-defects/archive-defects.js';
import './components/archive-failures/archive-failures.js';
import './components/archive-films/archive-films.js';
import './components/archive-map/archive-map.js';
import './components/asset-map/asset-map.js';
import './components/archive-projects/archive-projects.js';
import './components/archive-quality/archive-quality.js';
import './components/archive-register/archive-register.js';
import './components/archive-rules/archive-rules.js';
import './components/compare-page/compare-page.js';
import './components/inspection-list/inspection-list.js';
import './components/new-inspection/new-inspection.js';
import './components/report-template/report-template.js';
import './components/users-page/users-page.js';
import './components/inspection-page/inspection-page.js';

/** @type {[RegExp, string][]} path, element */
const PAGES = [
  [/^\/$/, 'inspection-list'],
  [/^\/new$/, 'new-inspection'],
  [/^\/compare$/, 'compare-page'],
  [/^\/users$/, 'users-page'],
  [/^\/archive$/, 'archive-films'],
  [/^\/archive\/add$/, 'archive-add'],
  [/^\/archive\/failures$/, 'archive-failures'],
  [/^\/archive\/rules$/, 'archive-rules'],
  [/^\/archive\/defects$/, 'archive-defects'],
  [/^\/archive\/projects$/, 'archive-projects'],
  [/^\/archive\/assets$/, 'archive-assets'],
  [/^\/archive\/map$/, 'archive-map'],
  [/^\/archive\/quality$/, 'archive-quality'],
  [/^\/archive\/register$/, 'archive-register'],
  [/^\/archive\/template$/, 'report-template'],
  [/^\/inspections\/([0-9a-f-]+)\/?$/, 'inspection-page'],
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
else reopenSettings();
