/** The films among the files that a person has chosen or dropped, with folders and what they contain. */

const FILM = /\.(mp4|m4v|mov|3gp|3g2|mkv|webm|avi|mpe?g|vob|ts|mts|m2ts)$/i;
const LONGEST_NAME = 200;

/**
 * A file with its path below the folder that was chosen; the path of a single file is its name.
 * @typedef {{file: File, path: string}} Found
 */

/**
 * Returns the files of an input, with or without `webkitdirectory`.
 * @param {HTMLInputElement} input
 * @returns {Found[]}
 */
export const filesOf = (input) =>
  [...input.files].map((file) => ({ file, path: file.webkitRelativePath || file.name }));

/**
 * Returns dropped files, and all files of dropped folders. Call it within the event: later the browser has
 * forgotten them.
 * @param {DataTransfer} transfer
 * @returns {Promise<Found[]>}
 */
export async function droppedFiles(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean);
  return (await Promise.all(entries.map(filesBelow))).flat();
}

/**
 * Separates films from other files, in the order of their paths, in which numbers count: 2 before 10. A single
 * file that a person has picked is taken for a film, whatever its name.
 * @param {Found[]} found
 * @returns {{films: Found[], others: number}}
 */
export function filmsAmong(found) {
  const isPicked = found.length === 1 && !found[0].path.includes('/');
  const films = isPicked ? found : found.filter(({ file }) => isFilm(file));
  return {
    films: films.toSorted((a, b) => a.path.localeCompare(b.path, undefined, { numeric: true })),
    others: found.length - films.length,
  };
}

/**
 * Returns the names of inspections: of the files, with their folders where two films would have the same.
 * @param {string[]} paths
 */
export function namesOf(paths) {
  const names = paths.map((path) => withoutEnding(path.split('/').at(-1)));
  /** @param {string} name */
  const isAmbiguous = (name) => names.filter((other) => other === name).length > 1;
  // The end of a path distinguishes two films.
  return paths.map((path, i) => (isAmbiguous(names[i]) ? withoutEnding(path) : names[i]).slice(-LONGEST_NAME));
}

/** @param {string} name */
const withoutEnding = (name) => name.replace(/(.)\.[^./]+$/, '$1');

/**
 * A name that begins with a dot is of a hidden file, such as those that macOS adds to every copied film.
 * @param {File} file
 */
const isFilm = ({ name, type }) => !name.startsWith('.') && (FILM.test(name) || type.startsWith('video/'));

/** @param {FileSystemEntry} entry @returns {Promise<Found[]>} */
async function filesBelow(entry) {
  if (entry.isFile) {
    const found = /** @type {FileSystemFileEntry} */ (entry);
    const file = await new Promise((resolve, reject) => found.file(resolve, reject));
    return [{ file, path: entry.fullPath.replace(/^\//, '') }];
  }
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  const children = [];
  // A reader returns at most a hundred entries at a time, and none when it has returned all.
  for (let some; (some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))).length; ) {
    children.push(...some);
  }
  return (await Promise.all(children.map(filesBelow))).flat();
}
