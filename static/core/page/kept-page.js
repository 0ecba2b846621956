/** Lets this browser keep the page, so that it opens while the server cannot be reached. */

/** Over plain http, except on this machine, browsers keep no page. */
export function keepPage() {
  // Where the browser refuses, everything but opening it without the server works.
  navigator.serviceWorker?.register('/service-worker.js', { updateViaCache: 'none' }).catch(console.warn);
}
