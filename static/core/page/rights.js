/**
 * Who the person is, and the rights, as the server wrote them into the page. They only control the page: the server
 * checks every request itself.
 */

export const ROLES = ['viewer', 'operator', 'admin'];
const { role, person: name, insecure } = document.documentElement.dataset;

/** Name of the logged-in person; undefined before the log-in. */
export const person = name;

/**
 * Whether the role is `needed` or higher. `data-needs` hides parts of the page that need more.
 * @param {string} needed
 */
export const may = (needed) => ROLES.indexOf(role) >= ROLES.indexOf(needed);

let isLocked = false;

/** Notes whether the inspection of the page is approved, so that nobody changes it. @param {boolean} locked */
export function lock(locked) {
  isLocked = locked;
  document.documentElement.toggleAttribute('data-locked', locked);
}

/** Whether the person may change the inspection of the page. */
export const mayEdit = () => may('operator') && !isLocked;

/** Whether other machines reach the server without encryption. */
export const isInsecure = insecure !== undefined;
