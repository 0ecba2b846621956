/** One listener for all keys of a page, and the table shown by the help. */

import { preferences } from './preferences.js';
import { t } from './words.js';

/**
 * @typedef {object} Binding
 * @property {string[]} keys as KeyboardEvent.key, with 'Shift+' or 'Ctrl+' before it where needed
 * @property {string} [label] what it does, for the help; none: the help does not list it
 * @property {string[]} [shown] the keys as the help writes them, if not all of `keys`
 * @property {(event: KeyboardEvent, key: string) => void} [run] none: the help alone lists it
 * @property {() => boolean} [when] its scope: within it the key is taken from a binding without one
 */

/**
 * Returns the name of a pressed key: 'a', 'Shift+a', 'Shift+3', 'Shift+ArrowLeft', 'Ctrl+z', '?'.
 * @param {KeyboardEvent} event
 */
export function keyName(event) {
  const digit = event.shiftKey && !/\d/.test(event.key) && /^Digit(\d)$/.exec(event.code)?.[1];
  const key = digit || (event.key.length === 1 ? event.key.toLowerCase() : event.key);
  const control = event.ctrlKey || event.metaKey ? 'Ctrl+' : '';
  // A printed sign, such as '?', already includes Shift.
  const isWithShift = event.shiftKey && (digit || event.key.length > 1 || /\p{L}/u.test(key));
  return control + (isWithShift ? 'Shift+' : '') + key;
}

/** @type {Record<string, string>} */
const SHOWN = { ' ': t('keys.space'), Escape: 'Esc', ArrowLeft: '←', ArrowRight: '→', ArrowUp: '↑', ArrowDown: '↓' };

/** 'Shift + ←', 'Ctrl + Z', 'T': a key as the help writes it. @param {string} key */
export const shownKey = (key) =>
  key
    .split(/\+(?=.)/)
    .map((part) => SHOWN[part] ?? (part.length === 1 ? part.toUpperCase() : part))
    .join(' + ');

/** The key that this person uses in place of a usual one. @param {string} usual */
export const keyFor = (usual) => preferences.value.keys[usual] ?? usual;

/** 'Shift+f' of 'Shift + F': a usual key as markup names it. @param {string} shown */
const usualOf = (shown) => shown.replaceAll(' + ', '+').replace(/(?<=^|\+)\p{Lu}$/u, (letter) => letter.toLowerCase());

/** 'Shift + F', or what this person has chosen in its place. @param {string} shown */
export const ownKey = (shown) => shownKey(keyFor(usualOf(shown)));

/** Letters, digits and signs, as keys or as shown: speech input types them. Arrows do not match. */
const SINGLE = /^(Shift\+)?[^\s←→](…\d)?$/u;

/** Whether a key is active: letters, digits and signs can be switched off (WCAG 2.1.4). @param {string} key */
export const isKeyOn = (key) => preferences.value.single_keys || !SINGLE.test(key.replaceAll(' ', ''));

/**
 * 'Play (Space)': the action of a button, with its key while that key is active.
 * @param {string} what
 * @param {string} [key]
 */
export function withKey(what, key) {
  const own = key && ownKey(key);
  return own && isKeyOn(own) ? t('video.with_key', { what, key: own }) : what;
}

const always = () => true;

/** Keys of a pedal, which no field needs. */
const PEDAL = /^(F\d+|Pause)$/;
const TYPING = 'input:not([type=range], [type=radio], [type=checkbox]), textarea, select';
/** @type {[string, Set<string>][]} */
const OWN_KEYS = [
  ['button, a[href], summary, [role=option]', new Set([' ', 'Enter'])],
  [
    '[role=slider], [type=range], [type=radio]',
    new Set([' ', 'ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown', 'Home', 'End', 'PageUp', 'PageDown']),
  ],
  ['[role=separator]', new Set(['ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown', 'Home'])],
  ['[role=tab]', new Set(['ArrowLeft', 'ArrowRight', 'Home', 'End'])],
];

/**
 * Whether the focused element, or a dialog, needs this key itself.
 * @param {EventTarget|null} target
 * @param {string} key
 */
export function isTaken(target, key) {
  // Checked on the page: the focus leaves a dialog's button when that is disabled.
  if (document.querySelector('dialog[open]')) return true;
  // A dialog that has just closed leaves the focus on its hidden field until the page is drawn again.
  if (!(target instanceof Element) || !target.checkVisibility()) return false;
  if (target.matches(TYPING)) return !PEDAL.test(key);
  return OWN_KEYS.some(([selector, keys]) => target.matches(selector) && keys.has(key));
}

/**
 * Listens on `target` until `signal` aborts.
 * @param {EventTarget} target
 * @param {Binding[]} bindings
 * @param {AbortSignal} signal
 * @param {Set<string>} [except] keys that `target` itself uses
 */
export function bindKeys(target, bindings, signal, except = new Set()) {
  let isFree = false;
  const scopedFirst = bindings.toSorted((a, b) => Number(!a.when) - Number(!b.when));
  target.addEventListener(
    'keydown',
    (/** @type {any} */ event) => {
      // Before the key closes what it was for: Escape in a form must not leave the page's selection, too.
      isFree = !isTaken(event.target, keyName(event));
    },
    { signal, capture: true },
  );
  target.addEventListener(
    'keydown',
    (/** @type {any} */ event) => {
      const key = keyName(event);
      // Looked up each time: the person may have put it on another key meanwhile.
      const binding = scopedFirst.find(
        ({ keys, when = always }) => keys.some((usual) => keyFor(usual) === key) && when(),
      );
      if (!binding || !isKeyOn(key) || event.altKey || except.has(key) || !isFree) return;
      event.preventDefault();
      binding.run(
        event,
        binding.keys.find((usual) => keyFor(usual) === key),
      );
    },
    { signal },
  );
}
