/**
 * Gestures on the strips: the wheel and two fingers zoom; Shift + wheel, the middle or right button and two
 * fingers pan; the left button or one finger scrubs; a click or tap acts.
 */

const CLICK_PX = 4;
const TAP_PX = 10;
const LINE_PX = 16;
/** Zoom per pixel of the wheel, and of a touchpad's pinch, which browsers report as Ctrl + wheel. */
const WHEEL = 0.0016;
const PINCH = 0.01;

/**
 * @typedef {object} Handlers coordinates are CSS px from the corner of the element
 * @property {(x: number) => number} toMm
 * @property {(x: number, y: number) => void} scrub
 * @property {(x: number, y: number) => void} tap
 * @property {(x: number|null, y: number|null) => void} hover null: it has left
 *
 * @param {HTMLElement} element
 * @param {import('../../../core/wall/axis.js').Axis} axis
 * @param {Handlers} handlers
 * @param {AbortSignal} signal
 */
export function stripGestures(element, axis, handlers, signal) {
  const { toMm, scrub, tap, hover } = handlers;
  /** @type {Map<number, {x: number, y: number}>} pressed pointers by id */
  const pressed = new Map();
  // IDLE => PRESSED => SCRUB | IDLE (a tap); IDLE => PAN => IDLE; any => PINCH by a second finger => IDLE
  let state = 'IDLE';
  let begun = null;

  const placeOf = ({ clientX, clientY }) => {
    const box = element.getBoundingClientRect();
    return { x: clientX - box.left, y: clientY - box.top };
  };
  const mmPerPx = () => toMm(1) - toMm(0);
  const listen = (type, handler, options = {}) => element.addEventListener(type, handler, { ...options, signal });

  listen('pointerdown', (event) => {
    pressed.set(event.pointerId, placeOf(event));
    element.setPointerCapture(event.pointerId);
    begun = placeOf(event);
    if (pressed.size > 1) state = 'PINCH';
    else state = event.button === 0 ? 'PRESSED' : 'PAN';
    if (state !== 'PRESSED') hover(null, null);
  });

  listen('pointermove', (event) => {
    const now = placeOf(event);
    const before = pressed.get(event.pointerId);
    if (!before) {
      hover(now.x, now.y);
      return;
    }
    const slack = event.pointerType === 'mouse' ? CLICK_PX : TAP_PX;
    if (state === 'PRESSED' && Math.abs(now.x - begun.x) > slack) state = 'SCRUB';
    if (state === 'SCRUB') scrub(now.x, now.y);
    if (state === 'PAN') axis.pan(toMm(before.x) - toMm(now.x));
    if (state === 'PINCH') pinch(event.pointerId, before, now);
    pressed.set(event.pointerId, now);
  });

  function pinch(id, before, now) {
    const other = [...pressed].find(([key]) => key !== id)?.[1];
    if (!other) return; // one of the two fingers has left
    const [from, to] = [before, now].map(({ x, y }) => Math.hypot(x - other.x, y - other.y));
    // Two fingers on one spot have no ratio.
    if (from > 1 && to > 1) axis.zoom(from / to, toMm((before.x + other.x) / 2));
    axis.pan(((before.x - now.x) / 2) * mmPerPx());
  }

  const end = (event) => {
    const isTap = state === 'PRESSED' && event.type === 'pointerup';
    pressed.delete(event.pointerId);
    if (pressed.size === 0) state = 'IDLE';
    if (isTap) tap(begun.x, begun.y);
    if (event.pointerType !== 'mouse') hover(null, null);
  };
  listen('pointerup', end);
  listen('pointercancel', end);
  listen('pointerleave', () => pressed.size === 0 && hover(null, null));
  // A click must not take the arrow keys away from stepping through the film.
  listen('mousedown', (event) => event.preventDefault());
  listen('contextmenu', (event) => event.preventDefault());

  listen(
    'wheel',
    (event) => {
      event.preventDefault();
      const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1;
      const [across, along] = [event.deltaX * unit, event.deltaY * unit];
      if (event.shiftKey) axis.pan((across || along) * mmPerPx());
      else if (Math.abs(across) > Math.abs(along)) axis.pan(across * mmPerPx());
      else axis.zoom(Math.exp(along * (event.ctrlKey ? PINCH : WHEEL)), toMm(placeOf(event).x));
    },
    { passive: false },
  );
}
