/** The archive on the server: what is done with many films at once, and whether it can be undone. */

import { get, patch, post, removeSome } from '../server/api.js';

/**
 * @typedef {'start'|'pause'|'resume'|'cancel'|'retry'} Action
 * @typedef {{ids: string[]}|{where: object}} Meant
 */

const FILMS = '/api/archive/films';

/** Names of the filters of the films, as in the address and in `where`. */
export const FILTERS = ['search', 'state', 'project', 'asset', 'reason', 'outdated'];

/** States in which each action changes a film. @type {Record<Action, string[]>} */
export const ACTS_ON = {
  start: ['ready', 'paused'],
  pause: ['waiting', 'queued', 'running'],
  resume: ['paused'],
  cancel: ['waiting', 'paused', 'queued', 'running'],
  retry: ['failed', 'cancelled', 'refused'],
};

/**
 * The action that brings a film back into the state it had before.
 * @type {Record<Action, Record<string, Action|null>>}
 */
const BACK = {
  start: { ready: 'cancel', paused: 'pause' },
  pause: { waiting: 'resume', queued: 'resume', running: 'resume' },
  resume: { paused: 'pause' },
  cancel: { waiting: 'start' },
  retry: { failed: 'cancel', refused: null, cancelled: 'cancel' },
};

/**
 * @param {Action} action
 * @param {Meant} meant
 * @returns {Promise<number>} films that changed
 */
export const act = async (action, meant) => (await post(`/api/archive/${action}`, meant)).changed;

/**
 * Sets rig, project, asset, header or priority; returns the number of films.
 * @param {Meant} meant
 * @param {Api['FilmChangeIn']} set
 * @returns {Promise<number>}
 */
export const change = async (meant, set) => (await patch(FILMS, { ...meant, set })).changed;

/** Takes films off the list; returns their number. @param {Meant} meant @returns {Promise<number>} */
export const takeOff = async (meant) => (await removeSome(FILMS, meant)).changed;

/** @param {AbortSignal} signal @returns {Promise<Api['ArchiveProgressOut']>} */
export const progressOf = (signal) => get('/api/archive/progress', signal);
/** @param {AbortSignal} signal @returns {Promise<Api['FailuresOut']>} */
export const failuresOf = (signal) => get('/api/archive/failures', signal);

/** Filters that are set, as `where` of a request. @param {Record<string, string>} filters */
export const whereOf = (filters) =>
  Object.fromEntries(
    FILTERS.filter((name) => filters[name]).map((name) => [name, name === 'outdated' || filters[name]]),
  );

/**
 * The films of a selection that the action changes.
 * @template {{state: string, outdated: boolean}} Film
 * @param {Action} action
 * @param {Film[]} films
 */
export const concerned = (action, films) =>
  films.filter(({ state, outdated }) => ACTS_ON[action].includes(state) || (action === 'retry' && outdated));

/**
 * Returns what undoes an action, or null where something of it is lost: a stopped run begins again at its
 * first frame.
 * @param {Action} action
 * @param {{id: string, state: string, outdated: boolean}[]} films as they were before
 */
export function undoOf(action, films) {
  const groups = Map.groupBy(concerned(action, films), ({ state }) => BACK[action][state] ?? null);
  if (groups.size === 0 || groups.has(null)) return null;
  return async () => {
    for (const [back, some] of groups) await act(back, { ids: some.map(({ id }) => id) });
  };
}
