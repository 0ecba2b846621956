/** Versions of imported code packs: which are offered, and which is the newest. */

/** @typedef {Api['PackOut']} Pack the newest version of a title comes first in their list */

/**
 * Returns the newest version of the title that a version has; undefined if it is gone.
 * @param {Pack[]} packs
 * @param {string|null|undefined} id
 */
export function newestOf(packs, id) {
  const title = packs.find((pack) => pack.id === id)?.title;
  return title === undefined ? undefined : packs.find((pack) => pack.title === title);
}

/**
 * Returns the packs that an inspection may be coded with: the newest versions for its project, and the one that it has.
 * @param {Pack[]} packs
 * @param {string|null} project
 * @param {string|null} [kept] id of the one that it has
 */
export const offered = (packs, project, kept = null) =>
  packs.filter(
    (pack) =>
      pack.id === kept || (newestOf(packs, pack.id) === pack && (pack.project === null || pack.project === project)),
  );

/**
 * Returns the project of an inspection, by the rule of the server: as stated, else its job.
 * @param {any} header
 */
export const projectOf = ({ project, job_ref: job, client_job_ref: theirs }) =>
  [project, job, theirs].map((text) => String(text ?? '').trim()).find(Boolean) ?? null;
