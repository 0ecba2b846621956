/** Gestures on a map: drag and two fingers move it, wheel and two fingers zoom, a click or tap picks. */

const LINE_PX = 16;
/** Zoom per pixel of the wheel, and of a touchpad's pinch, which browsers report as Ctrl + wheel. */
const WHEEL = 0.002;
const PINCH = 0.01;
/** A pointer that moves less than this has clicked, or tapped. */
const CLICK_PX = 5;
const TAP_PX = 10;

/**
 * @typedef {[number, number]} At CSS px from the corner of the element
 * @typedef {object} Handlers
 * @property {(by: At) => void} move
 * @property {(factor: number, at: At) => void} zoom
 * @property {(at: At|null) => void} point null: the pointer has left
 * @property {(at: At) => void} pick
 *
 * @param {HTMLElement} element
 * @param {Handlers} handlers
 * @param {AbortSignal} signal
 */
export function mapGestures(element, { move, zoom, point, pick }, signal) {
  /** @type {Map<number, At>} pressed pointers by id */
  const pressed = new Map();
  let begun = null;
  let isDrag = false;
  /** @returns {At} */
  const placeOf = ({ clientX, clientY }) => {
    const { left, top } = element.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  const listen = (type, run, options = {}) => element.addEventListener(type, run, { ...options, signal });

  listen('pointerdown', (event) => {
    if (event.button !== 0) return;
    if (pressed.size === 0) [begun, isDrag] = [placeOf(event), false];
    pressed.set(event.pointerId, placeOf(event));
    element.setPointerCapture(event.pointerId);
  });
  listen('pointermove', (event) => {
    const now = placeOf(event);
    const before = pressed.get(event.pointerId);
    if (!before) {
      point(now);
      return;
    }
    const slack = event.pointerType === 'mouse' ? CLICK_PX : TAP_PX;
    isDrag ||= pressed.size > 1 || apart(now, begun) > slack;
    if (!isDrag) return;
    const other = [...pressed].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      zoom(apart(now, other) / apart(before, other), between(now, other));
      move([(now[0] - before[0]) / 2, (now[1] - before[1]) / 2]);
    } else move([now[0] - before[0], now[1] - before[1]]);
    pressed.set(event.pointerId, now);
  });
  listen('pointerup', ({ pointerId }) => {
    const isPick = pressed.delete(pointerId) && pressed.size === 0 && !isDrag;
    if (isPick) pick(begun);
  });
  listen('pointercancel', ({ pointerId }) => pressed.delete(pointerId));
  listen('pointerleave', () => pressed.size === 0 && point(null));
  listen(
    'wheel',
    (event) => {
      event.preventDefault();
      const px = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
      zoom(Math.exp(-px * (event.ctrlKey ? PINCH : WHEEL)), placeOf(event));
    },
    { passive: false },
  );
}

/** @returns {At} */
const between = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

/** Two fingers on one spot have no ratio. */
const apart = (a, b) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
