/** Puts the page that belongs to the address into the shell. */

import { session } from './core/api.js';
import { toastError } from './components/toast-stack/toast-stack.js';
import './components/inspection-list/inspection-list.js';
import './components/new-inspection/new-inspection.js';
import './components/inspection-page/inspection-page.js';

const PAGES = [
  [/^\/$/, 'inspection-list'],
  [/^\/new$/, 'new-inspection'],
  [/^\/inspections\/([0-9a-f-]+)\/?$/, 'inspection-page'],
];

session.addEventListener('signed-out', () => {
  location.assign(`/login?next=${encodeURIComponent(location.pathname + location.search)}`);
});

// A fault in the page itself must not pass unseen.
addEventListener('unhandledrejection', ({ reason }) => {
  if (reason?.name !== 'AbortError') toastError(reason);
});
addEventListener('error', ({ error, message }) => toastError(error ?? new Error(message)));

const [, name] = PAGES.find(([pattern]) => pattern.test(location.pathname)) ?? PAGES[0];
const page = document.createElement(name);
page.inspectionId = location.pathname.split('/')[2];
document.body.insertBefore(page, document.querySelector('toast-stack'));
