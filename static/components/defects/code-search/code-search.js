/** Search for a code by its letters or by words: a text field with a list below it. */

import { html, render } from '../../../core/page/html.js';

/**
 * Makes a combobox of an input and a list (ARIA 1.2 pattern, list autocomplete).
 * @param {HTMLInputElement} input
 * @param {HTMLElement} list
 * @param {import('../../../core/defects/codes.js').Catalogue} catalogue
 * @param {(row: {code: string, char1: string, char2: string}) => void} onPick
 */
export function codeSearch(input, list, catalogue, onPick) {
  let found = [];
  let active = -1;

  const close = () => {
    list.hidden = true;
    active = -1;
    input.setAttribute('aria-expanded', 'false');
    input.removeAttribute('aria-activedescendant');
  };
  const point = (index) => {
    active = index;
    [...list.children].forEach((option, i) => option.setAttribute('aria-selected', String(i === index)));
    const option = list.children[index];
    if (!option) return;
    input.setAttribute('aria-activedescendant', option.id);
    option.scrollIntoView({ block: 'nearest' });
  };
  const open = () => {
    found = catalogue.search(input.value);
    render(
      list,
      html`${found.map(
        ({ code, char1, char2, label }, i) => html`<li role="option" id="${list.id}-${i}"
        aria-selected="false" data-index="${i}"><b>${[code, char1, char2].filter(Boolean).join(' ')}</b>
        <span>${label}</span></li>`,
      )}`,
    );
    list.hidden = found.length === 0;
    input.setAttribute('aria-expanded', String(found.length > 0));
    point(input.value ? 0 : -1);
  };
  const pick = (index) => {
    close();
    onPick(found[index]);
  };

  input.addEventListener('input', open);
  input.addEventListener('click', open);
  input.addEventListener('blur', close);
  input.addEventListener('keydown', (event) => {
    const { key } = event;
    if (key === 'ArrowDown' || key === 'ArrowUp') {
      event.preventDefault();
      if (list.hidden) open();
      else point((active + (key === 'ArrowDown' ? 1 : found.length - 1)) % found.length);
    } else if (key === 'Enter' && !list.hidden && active >= 0) {
      event.preventDefault();
      pick(active);
    } else if (key === 'Escape' && !list.hidden) {
      event.preventDefault(); // a surrounding dialog stays open
      event.stopPropagation();
      close();
    }
  });
  // Not on click: before the click arrives, the field would lose the focus and the list would close.
  list.addEventListener('mousedown', (event) => {
    event.preventDefault();
    const option = /** @type {Element} */ (event.target).closest('[data-index]');
    if (option) pick(Number(option.dataset.index));
  });
}
