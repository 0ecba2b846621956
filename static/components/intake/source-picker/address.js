/** Addresses of cameras and the log-ins in them: 'rtsp://user:password@host:port/path'. */

const PARTS = /^([a-z][a-z0-9+.-]*:\/\/)(?:([^/?#]*)@)?(.*)$/i;
/** Parameters in which some cameras take credentials. */
const SECRET = /pass|pwd|psw|user|usr|auth|token|key/i;

/**
 * @param {string} text
 * @returns {{address: string, user: string, password: string}} the address without its log-in
 */
export function addressOf(text) {
  const [, scheme, login, rest] = PARTS.exec(text) ?? [];
  if (!login) return { address: text, user: '', password: '' };
  const [user, ...password] = login.split(':');
  return { address: `${scheme}${rest}`, user: decoded(user), password: decoded(password.join(':')) };
}

/** Returns the address with a log-in, if a user is named. */
export function withLogin(text, user, password) {
  const found = addressOf(text);
  const [name, secret] = user ? [user, password] : [found.user, found.password];
  const [, scheme, , rest] = PARTS.exec(text) ?? [];
  if (!name || !scheme) return text;
  return `${scheme}${encodeURIComponent(name)}:${encodeURIComponent(secret)}@${rest}`;
}

/** Returns the part of an address that may be stored: without log-in, and without a query that has one. */
export function withoutSecrets(text) {
  const { address } = addressOf(text);
  const [place, query = ''] = address.split('?');
  return SECRET.test(query) ? place : address;
}

/** Decodes text; a stray % stays as it is. */
function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
