/**
 * What the person may do, as the server has written it into the page. It is for the page only: the
 * server checks every request by itself.
 */

const ROLES = ['viewer', 'operator', 'admin'];
const { role, insecure } = document.documentElement.dataset;

/** Whether the role is `needed` or more. What needs more is hidden in the page by `data-needs`. */
export const may = (needed) => ROLES.indexOf(role) >= ROLES.indexOf(needed);

/** Whether other machines reach the server without encryption. */
export const isInsecure = insecure !== undefined;
