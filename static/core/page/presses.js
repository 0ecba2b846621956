/** A press on a button counts, although the page moves under the pointer before it is released. */

/** What a press is for. */
const PRESSED = 'button, a[href], summary, label, [type=checkbox], [type=radio]';
/** A pointer that has moved further than this, in px, has left what it pressed. */
const STILL_PX = 5;

/**
 * Leaving a field may show a bar or a fault, which moves what was pressed away from the pointer; the browser then gives
 * the click to whatever both places have in common.
 */
export function keepPresses() {
  /** @type {{what: HTMLElement, x: number, y: number}|null} */
  let pressed = null;
  document.addEventListener(
    'pointerdown',
    ({ target, button, clientX: x, clientY: y }) => {
      const what = button === 0 && target instanceof Element ? target.closest(PRESSED) : null;
      pressed = what instanceof HTMLElement ? { what, x, y } : null;
    },
    { capture: true },
  );
  document.addEventListener(
    'click',
    ({ target, detail, clientX, clientY }) => {
      const press = pressed;
      pressed = null;
      const isByPointer = detail > 0; // keys, and clicks of the page itself, have none
      if (!press || !isByPointer || !(target instanceof Node) || press.what.contains(target)) return;
      if (Math.hypot(clientX - press.x, clientY - press.y) <= STILL_PX) press.what.click();
    },
    { capture: true },
  );
}
