/** Random names of what this browser makes. */

/** Returns a random UUID; `crypto.randomUUID` exists only over https and on localhost. */
export function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const hex = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, '$1-$2-$3-$4-$5');
}

let made = 0;

/** Returns an id that sorts after those made before in this browser. */
export function idInTime() {
  made += 1;
  return `${Date.now()}-${String(made).padStart(8, '0')}-${Math.random()}`;
}

/** New for each page: pairs its commands with the 3D view in it. */
export const pageId = newId().replaceAll('-', '');
