/**
 * Keeps the animation of another window from taking all the time of the page that they share: without
 * a graphics card a picture in 3D takes long, and everything else waits for it.
 */

/** Of the page's time, at most. */
const SHARE = 0.1;
/** Whoever moves the view sees every picture of it. */
const FREE_AFTER_TOUCH_MS = 500;
const TOUCHES = ['pointerdown', 'pointermove', 'wheel'];

/**
 * @param {Window} view its animation callbacks are put off from now on
 * @param {() => boolean} isLimited asked at each of them
 */
export function fairShare(view, isLimited) {
  const [request, cancel] = [view.requestAnimationFrame.bind(view), view.cancelAnimationFrame.bind(view)];
  const channel = new MessageChannel();
  /** What takes back the callback of an id. */
  const waiting = new Map();
  let [ids, pictureStamp, begunMs, nextMs, touchedMs] = [0, 0, 0, 0, -Infinity];

  // It arrives when the picture has been made, which happens after the callbacks.
  channel.port1.onmessage = () => (nextMs = begunMs + (performance.now() - begunMs) / SHARE);
  for (const type of TOUCHES) {
    const touched = ({ buttons }) => {
      if (buttons || type === 'wheel') touchedMs = performance.now();
    };
    view.addEventListener(type, touched, { passive: true, capture: true });
  }

  function animate(id, callback, stamp) {
    const now = performance.now();
    if (now < nextMs && now > touchedMs + FREE_AFTER_TOUCH_MS && isLimited()) {
      const timer = setTimeout(() => ask(id, callback), nextMs - now);
      waiting.set(id, () => clearTimeout(timer));
      return;
    }
    waiting.delete(id);
    if (stamp !== pictureStamp) {
      [pictureStamp, begunMs] = [stamp, now];
      channel.port2.postMessage(null);
    }
    callback(stamp);
  }

  function ask(id, callback) {
    const frame = request((stamp) => animate(id, callback, stamp));
    waiting.set(id, () => cancel(frame));
  }

  view.requestAnimationFrame = (callback) => {
    ids += 1;
    ask(ids, callback);
    return ids;
  };
  view.cancelAnimationFrame = (id) => {
    waiting.get(id)?.();
    waiting.delete(id);
  };
}
