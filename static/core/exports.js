/** Reports of an inspection as files, in the person's language and units. */

import { bodyOf, get, send } from './api.js';
import { lengthUnit } from './units.js';
import { language } from './words.js';

/** How long the address of a saved file stays valid; the browser reads it soon after the click. */
const KEPT_MS = 60_000;

const pathOf = (inspection, kind) => `/api/inspections/${inspection}/exports/${kind}`;
/** What an extra is in the query, where it is not `true`. */
const VALUES = { photos: 'embedded' };
const QUERY = new URLSearchParams({ lang: language, units: lengthUnit });

/** Returns the address of a report, for a link. */
export const exportPath = (inspection, kind, extras = []) =>
  `${pathOf(inspection, kind)}?${new URLSearchParams([...QUERY, ...extras.map((name) => [name, VALUES[name] ?? 'true'])])}`;

/**
 * Returns what the format cannot hold.
 * @param {string} inspection
 * @param {string} kind
 * @param {AbortSignal} signal
 * @returns {Promise<{detail: string, observation_id: string|null}[]>}
 */
export async function lossesOf(inspection, kind, signal) {
  const { losses } = await get(`${pathOf(inspection, kind)}/losses?${QUERY}`, signal);
  return losses;
}

/**
 * Requests a report, which may take a while.
 * @param {string[]} extras what it shows only where it is asked for
 * @returns {Promise<File>}
 */
export async function makeExport(inspection, kind, extras, signal) {
  const response = await send('GET', exportPath(inspection, kind, extras), { signal });
  const [, name] = /filename="([^"]+)"/.exec(response.headers.get('Content-Disposition')) ?? [];
  return new File([await bodyOf(response, 'blob')], name ?? kind);
}

/** Lets the browser itself load a report that may be larger than the memory of a page. */
export function download(inspection, kind, extras) {
  const link = document.createElement('a');
  link.href = exportPath(inspection, kind, extras);
  link.download = '';
  link.click();
}

/** Saves a file, like a click on a download link. */
export function save(file) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(file);
  link.download = file.name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}
