/** The register of assets on the server: look up, edit, import. */

import { ApiError, get, put, remove, sendFile } from '../server/api.js';

const REGISTER = '/api/register';
const OFFERED = 20;

/** Largest table that the server takes, in bytes. */
export const MOST_BYTES = 16 * 2 ** 20;

/** Fields that only mean something together, as in app/survey/assets/register.py. */
const TOGETHER = [
  ['shape', 'height_mm', 'width_mm'],
  ['known_length_m', 'known_length_source'],
  ['start_lat', 'start_lon', 'end_lat', 'end_lon'],
];

/** @typedef {Api['RegisteredAssetOut']} Asset */

/** @param {string} assetId */
const pathOf = (assetId) => `${REGISTER}/assets/${encodeURIComponent(assetId)}`;

/**
 * Returns the other spellings of an id, and the fields that the register has under it, null if none.
 * @returns {Promise<Api['AlikeOut']>}
 * @param {string} assetId
 * @param {AbortSignal} [signal]
 */
export const alike = (assetId, signal) => get(`${REGISTER}/like?${new URLSearchParams({ asset_id: assetId })}`, signal);

/**
 * Returns some registered ids that a text finds.
 * @param {string} text
 * @param {AbortSignal} [signal]
 * @returns {Promise<string[]>}
 */
export async function idsWith(text, signal) {
  /** @type {Api['RegisterOut']} */
  const { assets } = await get(
    `${REGISTER}/assets?${new URLSearchParams({ search: text, limit: String(OFFERED) })}`,
    signal,
  );
  return assets.map(({ asset_id: id }) => id);
}

/**
 * Returns an asset; null if the register does not have it.
 * @returns {Promise<Asset|null>}
 * @param {string} assetId
 * @param {AbortSignal} [signal]
 */
export async function loadAsset(assetId, signal) {
  try {
    return await get(pathOf(assetId), signal);
  } catch (error) {
    if (error instanceof ApiError && error.code === 'asset_not_found') return null;
    throw error;
  }
}

/**
 * Adds an asset or replaces it; `version`: the one that the change was based on.
 * @param {Pick<Asset, 'asset_id'|'project'|'header'|'line'>} asset
 * @param {string} [version]
 */
export const saveAsset = ({ asset_id: id, project, header, line }, version) =>
  put(pathOf(id), { project, header, line }, undefined, version);

/** Takes this version of an asset off the register. @param {Pick<Asset, 'asset_id'|'version'>} asset */
export const deleteAsset = ({ asset_id: id, version }) => remove(pathOf(id), undefined, version);

/**
 * Imports a table; a dry run only says what it would do.
 * @param {File} file
 * @param {boolean} isDryRun
 * @param {string[]} columns what each column holds: a field, with its unit as 'height_mm:in', or ''; none: it is guessed
 * @param {AbortSignal} [signal]
 * @returns {Promise<Api['RegisterImportOut']>}
 */
export function importTable(file, isDryRun, columns, signal) {
  const query = new URLSearchParams([['dry_run', String(isDryRun)], ...columns.map((column) => ['columns', column])]);
  return sendFile(`${REGISTER}/import?${query}`, file, signal);
}

/**
 * Returns which fields of the register a header lacks and does not contradict.
 * @param {Record<string, unknown>} fields
 * @param {Record<string, unknown>} header
 */
export function lacking(fields, header) {
  /** @param {string} name */
  const isEmpty = (name) => (header[name] ?? '') === '';
  /** @param {string} name */
  const contradicts = (name) => name in fields && !isEmpty(name) && header[name] !== fields[name];
  const contradicted = new Set(TOGETHER.filter((names) => names.some(contradicts)).flat());
  if (!isEmpty('job_ref') || !isEmpty('client_job_ref')) contradicted.add('project');
  return Object.fromEntries(Object.entries(fields).filter(([name]) => isEmpty(name) && !contradicted.has(name)));
}

/**
 * A line as text: 'latitude, longitude' of a point in each row, as maps write them.
 * @param {[number, number][]} line
 */
export const lineText = (line) => line.map(([lon, lat]) => `${lat}, ${lon}`).join('\n');

/**
 * Reads such a text.
 * @returns {{line: [number, number][], fault: string|null}} fault: the first row that is no place
 * @param {string} text
 */
export function readLine(text) {
  const rows = text
    .split('\n')
    .map((row) => row.trim())
    .filter(Boolean);
  const points = rows.map((row) => {
    const found = /^(-?\d+(?:\.\d+)?)[\s,;]+(-?\d+(?:\.\d+)?)$/.exec(row.replaceAll('−', '-'));
    const [lat, lon] = found ? [Number(found[1]), Number(found[2])] : [NaN, NaN];
    return Math.abs(lat) <= 90 && Math.abs(lon) <= 180 ? /** @type {[number, number]} */ ([lon, lat]) : null;
  });
  const wrong = points.indexOf(null);
  return wrong < 0 ? { line: points, fault: null } : { line: [], fault: rows[wrong] };
}
