/** A long random number, new for each page, that pairs the page's commands with the 3D view in it. */

const bytes = crypto.getRandomValues(new Uint8Array(16));

/** 32 hexadecimal digits. */
export const pageId = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
