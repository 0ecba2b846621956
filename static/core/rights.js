/**
 * The person's rights, as the server wrote them into the page. They only control the page: the server
 * checks every request itself.
 */

const ROLES = ['viewer', 'operator', 'admin'];
const { role, insecure } = document.documentElement.dataset;

/** Whether the role is `needed` or higher. `data-needs` hides parts of the page that need more. */
export const may = (needed) => ROLES.indexOf(role) >= ROLES.indexOf(needed);

/** Whether other machines reach the server without encryption. */
export const isInsecure = insecure !== undefined;
