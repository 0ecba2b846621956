/**
 * Opens the page while the server cannot be reached, with what this browser has read before.
 *
 * The server always comes first. Kept are the page itself and what it read about the last inspections that
 * were opened; films and live pictures are not. A page that was opened from here has `data-kept` and asks for
 * kept answers (`Chainage-Kept`), so a page that loses its server while it is open still learns of it. What is
 * kept belongs to one person: a log-in, a log-out and a session that has ended remove it.
 */

const PAGE = 'chainage-page';
const DATA = 'chainage-data';
/** Inspections whose data are kept: those that were opened last. */
const INSPECTIONS = 3;
/** Longer answers are not kept. */
const LONGEST_BYTES = 20e6;
/** Time after which a silent server counts as unreachable when a page is opened. */
const ANSWER_LIMIT_MS = 8000;
/** The one entry of the page, whatever its address: its script reads that. */
const SHELL = '/';

const INSPECTION = /^\/api\/inspections\/([0-9a-f]{32})(\/|$)/;
const NOT_KEPT = /\/(video|live|frames|exports|thumbnail)(\/|$)/;
const OF_ALL = /^\/api\/(me|session|codes|header-fields|packs)(\/|$)/;
const FILE = /^\/static\/v[0-9a-f]{16}\//;

/** Counts the removals of data, so that an answer that was asked for before one is not kept after it. */
let removals = 0;

addEventListener('install', (event) => event.waitUntil(install()));
addEventListener('activate', (event) => event.waitUntil(self.clients.claim()));
addEventListener('fetch', (event) => {
  const { request } = event;
  const { origin, pathname } = new URL(request.url);
  if (origin !== location.origin) return;
  if (pathname === '/api/login' || pathname === '/api/logout') {
    event.respondWith(asAnother(request));
    return;
  }
  if (request.method !== 'GET') return;
  if (request.mode === 'navigate') {
    if (!/^\/(login|viewer|api)(\/|$)/.test(pathname)) event.respondWith(page(event));
  } else if (FILE.test(pathname)) {
    event.respondWith(file(request));
  } else if (isKept(pathname) && !request.headers.has('Range')) {
    event.respondWith(data(event));
  }
});

/** Sends a log-in or log-out; what one person has read is removed before it, and what came meanwhile after it. */
async function asAnother(request) {
  await removeData();
  try {
    return await fetch(request);
  } finally {
    await removeData();
  }
}

const isKept = (pathname) => (INSPECTION.test(pathname) || OF_ALL.test(pathname)) && !NOT_KEPT.test(pathname);

async function install() {
  await self.skipWaiting();
  const before = removals;
  const answer = await fetch(SHELL);
  if (isPage(answer)) await keepPage(answer, before);
}

/** Whether it is the page, and not the log-in, to which a server redirects. */
const isPage = (answer) => answer.ok && !answer.redirected;

/** Returns the page from the server; if that cannot be reached, the kept one, which says so. */
async function page(event) {
  const before = removals;
  try {
    const answer = await fetch(event.request, { signal: AbortSignal.timeout(ANSWER_LIMIT_MS) });
    if (isPage(answer)) event.waitUntil(keepPage(answer.clone(), before));
    return answer;
  } catch (error) {
    const kept = await caches.match(SHELL, { cacheName: PAGE });
    if (!kept) throw error;
    const { headers } = kept;
    const shell = await kept.text();
    return new Response(shell.replace('<html', `<html data-kept="${headers.get('Date')}"`), { headers });
  }
}

/** Keeps a page with the files that it names, and removes those of earlier versions. */
async function keepPage(answer, before) {
  const cache = await caches.open(PAGE);
  const shell = await answer.clone().text();
  const named = [...shell.matchAll(/"(\/static\/v[0-9a-f]{16}\/)([^"]+)"/g)];
  if (!named.length) return;
  const [, folder] = named[0];
  const files = named.map(([, , name]) => name);
  const wanted = files.map((name) => new URL(folder + name, location.origin).href);
  const known = (await cache.keys()).map(({ url }) => url);
  await cache.addAll(wanted.filter((url) => !known.includes(url)));
  if (before === removals) await cache.put(SHELL, answer);
  const old = known.filter((url) => FILE.test(new URL(url).pathname) && !new URL(url).pathname.startsWith(folder));
  await Promise.all(old.map((url) => cache.delete(url)));
}

/** Returns a file of the page; it never changes under its address. */
async function file(request) {
  return (await caches.match(request, { cacheName: PAGE })) ?? fetch(request);
}

/** Returns an answer of the server; if that cannot be reached, the kept one to whoever asks for it. */
async function data(event) {
  const { request } = event;
  const before = removals;
  try {
    const answer = await fetch(request);
    if (answer.ok) event.waitUntil(keepData(request.url, answer.clone(), before));
    if (answer.status === 401) event.waitUntil(removeData());
    return answer;
  } catch (error) {
    const isWanted = request.headers.has('Chainage-Kept') || request.destination === 'image';
    const kept = isWanted && (await caches.match(request.url, { cacheName: DATA }));
    if (!kept) throw error;
    return kept;
  }
}

async function keepData(url, answer, before) {
  if (Number(answer.headers.get('Content-Length')) > LONGEST_BYTES) return;
  const body = await answer.blob();
  const cache = await caches.open(DATA);
  if (before !== removals) return;
  const { pathname } = new URL(url);
  const id = INSPECTION.exec(pathname)?.[1];
  const isOpened = id !== undefined && pathname.endsWith(id) && !(await cache.match(url));
  try {
    await cache.put(url, new Response(body, { headers: answer.headers }));
  } catch (error) {
    if (error.name !== 'QuotaExceededError') throw error;
    await removeData(); // nothing depends on it; what is read next is kept again
    return;
  }
  if (isOpened) await removeOldest(cache);
}

/** Removes the data of all inspections but those that were opened last. */
async function removeOldest(cache) {
  const requests = await cache.keys(); // in the order in which they were kept
  const idOf = ({ url }) => INSPECTION.exec(new URL(url).pathname)?.[1];
  const opened = requests.filter(({ url }) => /\/api\/inspections\/[0-9a-f]{32}$/.test(url)).map(idOf);
  const kept = new Set(opened.slice(-INSPECTIONS));
  const old = requests.filter((request) => idOf(request) && !kept.has(idOf(request)));
  await Promise.all(old.map((request) => cache.delete(request)));
}

/** Removes what one person has read, and the page, which names them. */
async function removeData() {
  removals += 1;
  await Promise.all([caches.delete(DATA), caches.open(PAGE).then((cache) => cache.delete(SHELL))]);
}
