/**
 * Escaping markup: the only module of the page that writes HTML.
 *
 * `html` escapes every value, whatever its origin; `render` puts the result into an element.
 */

/** @type {Record<string, string>} */
const ENTITIES = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;', "'": '&#39;' };

class Markup {
  /** @param {string} text */
  constructor(text) {
    this.text = text;
  }
}

/**
 * @param {unknown} value
 * @returns {string}
 */
function escaped(value) {
  if (value instanceof Markup) return value.text;
  if (Array.isArray(value)) return value.map(escaped).join('');
  if (value === null || value === undefined || value === false) return '';
  return String(value).replace(/[&<>"']/g, (character) => ENTITIES[character]);
}

/**
 * Template tag. Text is escaped, nested markup and lists of it are kept, `null` and `false` are dropped.
 * @param {TemplateStringsArray} strings
 * @param {unknown[]} values
 * @returns {Markup}
 */
export function html(strings, ...values) {
  return new Markup(strings.reduce((text, piece, i) => text + escaped(values[i - 1]) + piece));
}

/**
 * Replaces the content of an element.
 * @template [Named=Record<string, any>]
 * @param {Element} element
 * @param {Markup} markup
 * @returns {Named} the elements marked `data-part`, by that name
 */
export function render(element, markup) {
  const template = document.createElement('template');
  template.innerHTML = markup.text;
  // Collected before the markup enters the page: custom elements in it have not added their own parts yet.
  const named = allOf(template.content, '[data-part]');
  const parts = Object.fromEntries(named.map((part) => [part.dataset.part, part]));
  element.replaceChildren(template.content);
  return /** @type {Named} */ (parts);
}

/** What each element shows, of those that `renderNew` has filled. @type {WeakMap<Element, string>} */
const shown = new WeakMap();

/**
 * Renders only what differs from what the element shows: else focus, selection and half-typed text would go.
 * @param {Element} element
 * @param {Markup} markup
 */
export function renderNew(element, markup) {
  if (shown.get(element) === markup.text) return;
  shown.set(element, markup.text);
  render(element, markup);
}

/**
 * Returns the elements of the page's own markup that a selector finds.
 * @template {Element} [Found=HTMLElement]
 * @param {ParentNode} root
 * @param {string} selector
 * @returns {Found[]}
 */
export const allOf = (root, selector) => /** @type {Found[]} */ ([...root.querySelectorAll(selector)]);

/**
 * Sets a text only if it changed: thirty pictures a second must not repeat the layout.
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Updates the children of `container` to match `items` without rebuilding those that stay, so that focus
 * and scroll position survive.
 * @template Item
 * @template {Element} Row
 * @param {Element} container whose children are all made here
 * @param {readonly Item[]} items
 * @param {(item: Item) => string|number} keyOf
 * @param {(item: Item) => Row} create
 * @param {(element: Row, item: Item) => void} update
 */
export function patchList(container, items, keyOf, create, update) {
  const children = /** @type {any[]} */ ([...container.children]);
  const present = new Map(children.map((child) => [child.dataset.key, child]));
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
