/** Reports of an inspection as files, in the person's language and units. */

import { ApiError, bodyOf, get, poll, post, remove, send } from '../server/api.js';
import { lengthUnit } from '../wall/units.js';
import { language } from '../page/words.js';

/** How long the address of a saved file stays valid; the browser reads it soon after the click. */
const KEPT_MS = 60_000;
/** Pause between two looks at an order. */
const LOOK_S = 0.5;

/** @param {string} inspection @param {string} kind */
const pathOf = (inspection, kind) => `/api/inspections/${inspection}/exports/${kind}`;
const QUERY = new URLSearchParams({ lang: language, units: lengthUnit });

/** Extras that are a choice; the others are switched on by `true`. @type {Record<string, [string, string]>} */
const CHOICES = { csv_german: ['csv', 'german'], photos: ['photos', 'embedded'] };

/** Returns the fields of a request for these extras. @param {string[]} extras */
export const extraFields = (extras) => Object.fromEntries(extras.map((name) => CHOICES[name] ?? [name, true]));

/**
 * Returns the address of a report, for a link.
 * @param {string} inspection
 * @param {string} kind
 * @param {string[]} [extras]
 */
export const exportPath = (inspection, kind, extras = []) =>
  `${pathOf(inspection, kind)}?${new URLSearchParams([...QUERY, ...Object.entries(extraFields(extras))])}`;

/**
 * Returns what the format cannot hold.
 * @param {string} inspection
 * @param {string} kind
 * @param {AbortSignal} signal
 * @returns {Promise<Api['LossOut'][]>}
 */
export async function lossesOf(inspection, kind, signal) {
  const { losses } = await get(`${pathOf(inspection, kind)}/losses?${QUERY}`, signal);
  return losses;
}

/**
 * Requests a report, which may take a while.
 * @param {string} inspection
 * @param {string} kind
 * @param {string[]} extras what it shows only where it is asked for
 * @param {AbortSignal} [signal]
 * @returns {Promise<File>}
 */
export async function makeExport(inspection, kind, extras, signal) {
  const response = await send('GET', exportPath(inspection, kind, extras), { signal });
  const [, name] = /filename="([^"]+)"/.exec(response.headers.get('Content-Disposition')) ?? [];
  return new File([await bodyOf(response, 'blob')], name ?? kind);
}

/**
 * Follows an order until it has ended; the server drops it when `signal` aborts.
 * @param {Partial<Api['BulkExportIn']>} wanted
 * @param {AbortSignal} signal
 * @param {(progress: Api['BulkExportOut']) => void} show
 * @param {(error: ApiError) => void} onTrouble gets errors that end by themselves
 * @returns {Promise<string|null>} address of the order; null once it is aborted
 */
export async function order(wanted, signal, show, onTrouble) {
  const { id } = await post('/api/bulk-exports', wanted);
  const path = `/api/bulk-exports/${id}`;
  /** @type {ApiError|null} */
  let fault = null;
  await poll(
    async () => {
      const progress = await get(path, signal);
      show(progress);
      return ['waiting', 'running'].includes(progress.state) ? LOOK_S : null;
    },
    signal,
    (error) => {
      if (error.isTemporary) onTrouble(error);
      else fault = error;
    },
  );
  if (fault) throw fault;
  if (!signal.aborted) return path;
  await discard(path);
  return null;
}

/** Drops an order; one that has gone is dropped already. @param {string} path */
export async function discard(path) {
  try {
    await remove(path);
  } catch (error) {
    // Another order may have replaced it; without a network it is replaced later.
    if (!(error instanceof ApiError)) throw error;
  }
}

/** Saves a file, like a click on a download link. @param {File} file */
export function save(file) {
  const url = URL.createObjectURL(file);
  follow(url, file.name);
  setTimeout(() => URL.revokeObjectURL(url), KEPT_MS);
}

/** Lets the browser download an address to the disk, however large it is. @param {string} url @param {string} name */
export function follow(url, name) {
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
}
