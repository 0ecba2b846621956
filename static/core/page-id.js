/** What pairs this page's commands with the 3D view in it: a long random number, new for each page. */

const bytes = crypto.getRandomValues(new Uint8Array(16));

/** 32 hexadecimal digits. */
export const pageId = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
