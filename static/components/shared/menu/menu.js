/** A `details` element that behaves as a menu: Escape and a click elsewhere close it. */

/**
 * @param {HTMLDetailsElement} menu its items have the class `menu__item`
 * @param {AbortSignal} signal
 */
export function closesElsewhere(menu, signal) {
  const close = () => (menu.open = false);
  document.addEventListener(
    'click',
    (event) => {
      const target = /** @type {Element} */ (event.target);
      if (!menu.contains(target) || target.closest('.menu__item')) close();
    },
    { signal },
  );
  addEventListener('blur', close, { signal });
  menu.addEventListener(
    'keydown',
    (event) => {
      if (event.key !== 'Escape' || !menu.open) return;
      event.stopPropagation();
      close();
      menu.querySelector('summary').focus();
    },
    { signal },
  );
}
