/** Wheel, pinch and drag on the film: they enlarge the picture and move it. */

const WHEEL_PX = 400;
/** A pointer that moves less than this has clicked. */
const CLICK_PX = 5;

/**
 * @param {HTMLElement} element that takes the pointer, as large as the stage
 * @param {import('./film-view.js').FilmView} view
 * @param {() => [[number, number], {width: number, height: number}]} sizes of stage and video
 * @param {AbortSignal} signal
 */
export function filmGestures(element, view, sizes, signal) {
  /** Where each pressed pointer is. */
  const pressed = new Map();
  let hasMoved = false;
  /** @returns {[number, number]} */
  const at = ({ clientX, clientY }) => {
    const { left, top } = element.getBoundingClientRect();
    return [clientX - left, clientY - top];
  };
  const listen = (type, run, options = {}) => element.addEventListener(type, run, { signal, ...options });

  listen(
    'wheel',
    (event) => {
      // A page that scrolls keeps the wheel until the picture is enlarged by other means.
      const { scrollHeight } = document.scrollingElement;
      if (view.isWhole && !event.ctrlKey && scrollHeight > innerHeight) return;
      event.preventDefault();
      view.zoomAt(Math.exp(-event.deltaY / WHEEL_PX), ...at(event), ...sizes());
    },
    { passive: false },
  );
  listen('pointerdown', (event) => {
    if (event.button !== 0) return;
    if (pressed.size === 0) hasMoved = false;
    pressed.set(event.pointerId, { at: at(event), from: at(event) });
  });
  listen('pointermove', (event) => {
    if (event.buttons === 0) pressed.delete(event.pointerId); // released outside, or over a menu
    const own = pressed.get(event.pointerId);
    if (!own) return;
    const before = [...pressed.values()].map((pointer) => pointer.at);
    own.at = at(event);
    if (Math.hypot(own.at[0] - own.from[0], own.at[1] - own.from[1]) > CLICK_PX) hasMoved = true;
    if (!hasMoved || (view.isWhole && pressed.size < 2)) return;
    if (!element.hasPointerCapture(event.pointerId)) element.setPointerCapture(event.pointerId);
    const now = [...pressed.values()].map((pointer) => pointer.at);
    const [middle, last] = [middleOf(now), middleOf(before)];
    if (now.length === 2) view.zoomAt(apart(now) / apart(before), ...middle, ...sizes());
    view.move(middle[0] - last[0], middle[1] - last[1], ...sizes());
  });
  for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    listen(type, ({ pointerId }) => pressed.delete(pointerId));
  }
  // A drag is no click: it would tag the wall under its end.
  listen(
    'click',
    (event) => {
      if (hasMoved && !view.isWhole) event.stopImmediatePropagation();
      hasMoved = false;
    },
    { capture: true },
  );
}

/** @param {[number, number][]} points @returns {[number, number]} */
const middleOf = (points) =>
  points.length === 2 ? [(points[0][0] + points[1][0]) / 2, (points[0][1] + points[1][1]) / 2] : points[0];

/** @param {[number, number][]} points */
const apart = ([a, b]) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
