/**
 * Escaping markup: the only module of the page that writes HTML.
 *
 * `html` escapes every value, whatever its origin; `render` puts the result into an element.
 */

const ENTITIES = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', "'": '&#39;' };

class Markup {
  constructor(text) {
    this.text = text;
  }
}

function escaped(value) {
  if (value instanceof Markup) return value.text;
  if (Array.isArray(value)) return value.map(escaped).join('');
  if (value === null || value === undefined || value === false) return '';
  return String(value).replace(/[&<>"']/g, (character) => ENTITIES[character]);
}

/**
 * Template tag. Text is escaped, nested markup and lists of it are kept, `null` and `false` are dropped.
 * @returns {Markup}
 */
export function html(strings, ...values) {
  return new Markup(strings.reduce((text, piece, i) => text + escaped(values[i - 1]) + piece));
}

/**
 * Replaces the content of an element.
 * @param {Element} element
 * @param {Markup} markup
 * @returns {Record<string, HTMLElement>} the elements marked `data-part`, by that name
 */
export function render(element, markup) {
  const template = document.createElement('template');
  template.innerHTML = markup.text;
  // Collected before the markup enters the page: custom elements in it have not added their own parts yet.
  const named = [...template.content.querySelectorAll('[data-part]')];
  const parts = Object.fromEntries(named.map((part) => [part.dataset.part, part]));
  element.replaceChildren(template.content);
  return parts;
}

/** Sets a text only if it changed: thirty pictures a second must not repeat the layout. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Updates the children of `container` to match `items` without rebuilding those that stay, so that focus
 * and scroll position survive.
 * @param {Element} container
 * @param {Array<object>} items
 * @param {(item: object) => string} keyOf
 * @param {(item: object) => Element} create
 * @param {(element: Element, item: object) => void} update
 */
export function patchList(container, items, keyOf, create, update) {
  const present = new Map([...container.children].map((child) => [child.dataset.key, child]));
  let next = container.firstElementChild;
  for (const item of items) {
    const key = String(keyOf(item));
    let child = present.get(key);
    if (!child) {
      child = create(item);
      child.dataset.key = key;
    }
    present.delete(key);
    update(child, item);
    if (child === next) next = next.nextElementSibling;
    else container.insertBefore(child, next);
  }
  for (const child of present.values()) child.remove();
}
