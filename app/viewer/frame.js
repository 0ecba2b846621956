// Of the page of the 3D view alone: its origin is opaque, so it and the page around it share nothing
// but these messages.  From the page: {isLimited, keys}.  To the page: the keys that are pressed here,
// where the pointer rests, and while the view is limited how long a picture takes and when the next comes.

// viser's client compiles script when it starts, for splats, and when its server sends some.  Our policy
// refuses both, and would report each try as an error of the page: what is compiled does nothing here.
const refuse = () => {
  throw new EvalError('This page compiles no script.');
};
const compiled = () => () => refuse;
globalThis.Function = new Proxy(Function, { apply: compiled, construct: compiled });

// viser's client fetches what it carries itself as data: addresses, and our policy allows no fetch of
// such an address, as it could hold anything.  What stands in a script of this page is handed out here.
const fetchOthers = window.fetch;
window.fetch = async (resource, options) => {
  const url = resource instanceof Request ? resource.url : String(resource);
  const isCarried = url.startsWith('data:') && [...document.scripts].some(({ text }) => text.includes(url));
  if (!isCarried) return fetchOthers(resource, options);
  const [, type, packed] = /^data:([^;,]*);base64,(.*)$/.exec(url);
  const bytes = Uint8Array.from(atob(packed), (character) => character.charCodeAt(0));
  return new Response(bytes, { headers: { 'Content-Type': type } });
};

// An opaque origin cannot load module workers by blob: addresses.  Without one for a script viser's
// client takes its other way, by data: addresses.
const { createObjectURL } = URL;
URL.createObjectURL = (object) => (/^text\/javascript/.test(object.type) ? '' : createObjectURL(object));

// The client writes its server into the address, which stays as it is: of the page's own server.
history.replaceState = () => {};

const fromPage = { isLimited: false, keys: new Set() };
addEventListener('message', ({ source, data }) => {
  if (source !== parent || source === window) return;
  fromPage.isLimited = data.isLimited === true;
  fromPage.keys = new Set(data.keys);
});

addEventListener('keydown', (event) => {
  if (parent === window) return;
  const { key, code, shiftKey, ctrlKey, metaKey, altKey, repeat } = event;
  const name = (ctrlKey || metaKey ? 'Ctrl+' : '') + (key.length === 1 ? key.toLowerCase() : key);
  if (fromPage.keys.has(name) && !altKey) event.preventDefault();
  parent.postMessage({ key, code, shiftKey, ctrlKey, metaKey, altKey, repeat }, location.origin);
});

// What is under the pointer is looked up on the server, so a moving pointer is reported seldom.  While a
// button is pressed the view is being turned, and nothing is looked up.
const POINTER_EVERY_MS = 150;
let [pointer, pointerTimer] = [null, 0];

function reportPointer() {
  pointerTimer = 0;
  if (parent !== window) parent.postMessage({ pointer }, location.origin);
}

function pointAt(at) {
  pointer = at;
  pointerTimer ||= setTimeout(reportPointer, POINTER_EVERY_MS);
}

addEventListener(
  'pointermove',
  ({ buttons, clientX, clientY }) => {
    if (!buttons) pointAt([clientX / innerWidth, clientY / innerHeight]);
  },
  { passive: true, capture: true },
);
document.documentElement.addEventListener('pointerleave', () => pointAt(null));

// Without a graphics card a 3D picture takes long, and everything else waits for it.  While a camera
// runs, and while nothing has changed, the animation takes these shares of the time at most.
const LIVE_SHARE = 0.1;
const IDLE_SHARE = 0.05;
// A person who moves the view sees every picture of it, and changes are shown at once.
const FREE_AFTER_TOUCH_MS = 500;
const FREE_AFTER_CHANGE_MS = 1000;
const [request, cancel] = [window.requestAnimationFrame, window.cancelAnimationFrame];
const channel = new MessageChannel();
/** For each id how to cancel its callback and, while it is delayed, how to request it at once. */
const waiting = new Map();
let [ids, pictureStamp, begunMs, nextMs, touchedMs, changedMs] = [0, 0, 0, 0, -Infinity, -Infinity];

// It arrives when the picture has been made, which happens after the callbacks.
channel.port1.onmessage = () => {
  const share = fromPage.isLimited ? LIVE_SHARE : IDLE_SHARE;
  const tookMs = performance.now() - begunMs;
  nextMs = begunMs + tookMs / share;
  if (fromPage.isLimited && parent !== window) {
    parent.postMessage({ tookMs, everyMs: tookMs / share }, location.origin);
  }
};
for (const type of ['pointerdown', 'pointermove', 'wheel']) {
  const touched = ({ buttons }) => {
    if (!buttons && type !== 'wheel') return;
    touchedMs = performance.now();
    hurry();
  };
  addEventListener(type, touched, { passive: true, capture: true });
}
addEventListener('resize', changed);

// viser's client hears its server in a worker, and lays out text in others.
const HeardWorker = window.Worker;
window.Worker = class extends HeardWorker {
  constructor(...source) {
    super(...source);
    this.addEventListener('message', changed);
  }
};

function changed() {
  changedMs = performance.now();
  if (!fromPage.isLimited) hurry();
}

function isFree(now) {
  const isChanging = !fromPage.isLimited && now < changedMs + FREE_AFTER_CHANGE_MS;
  return isChanging || now < touchedMs + FREE_AFTER_TOUCH_MS;
}

/** Draws what was delayed. */
function hurry() {
  for (const { release } of [...waiting.values()]) release?.();
}

function animate(id, callback, stamp) {
  const now = performance.now();
  if (now < nextMs && !isFree(now)) {
    const timer = setTimeout(() => ask(id, callback), nextMs - now);
    const takeBack = () => clearTimeout(timer);
    waiting.set(id, { takeBack, release: () => (takeBack(), ask(id, callback)) });
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
  const frame = request.call(window, (stamp) => animate(id, callback, stamp));
  waiting.set(id, { takeBack: () => cancel.call(window, frame) });
}

window.requestAnimationFrame = (callback) => {
  ids += 1;
  ask(ids, callback);
  return ids;
};
window.cancelAnimationFrame = (id) => {
  waiting.get(id)?.takeBack();
  waiting.delete(id);
};
