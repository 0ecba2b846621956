/**
 * Parts of the desk in windows of their own, for a second screen. Such a window is the page of the same inspection with
 * `?window=&desk=`, tied to the desk that opened it by a channel of this browser that is named after the inspection and
 * that desk: another tab of the same inspection keeps its parts.
 *
 * Messages of the desk: `who` asks which windows are open, `shown` {playhead, selection, isPicking}, `close` {part}.
 * Those of a window: `open` and `closed` {part}, `seek` {frame}, `select` {id}, `picked` {found}, `unpicked`. What is
 * tagged or changed needs none: every page follows the server and this browser's outbox.
 */

import { newId } from './new-id.js';
import { Store } from './store.js';

/**
 * @typedef {import('../../components/desk/page/desk.js').Desk} Desk
 * @typedef {{frame: number, pixel: [number, number]}} Found a place of the wall that a person has picked
 */

/** @type {('viewer'|'wall')[]} */
const PARTS = ['viewer', 'wall'];
const FEATURES = 'popup,width=1200,height=760';

/** Id of the desk in this tab, which outlives a reload: its windows are still there then. */
const REMEMBERED = 'chainage.desk';

const asked = () => new URLSearchParams(location.search);

/** The part that this page is the window of, null for a whole desk. */
export const partOfWindow = () => PARTS.find((part) => part === asked().get('window')) ?? null;

/** @param {Desk} desk @param {string|null} opener */
const channelOf = ({ inspection }, opener) => new BroadcastChannel(`chainage-desk-${inspection.id}-${opener}`);

/** Returns the id of the desk in this tab. */
function deskOfTab() {
  const id = sessionStorage.getItem(REMEMBERED) ?? newId();
  sessionStorage.setItem(REMEMBERED, id);
  return id;
}

/**
 * The desk's side: a store of the parts that are in windows of their own, in any order.
 * @extends {Store<string[]>}
 */
export class DeskWindows extends Store {
  #desk;
  #channel;
  #id = deskOfTab();
  /** Id of an observation that a window has selected before it arrived here. @type {string|null} */
  #awaited = null;

  /**
   * @param {Desk} desk
   * @param {AbortSignal} signal
   */
  constructor(desk, signal) {
    super([]);
    this.#desk = desk;
    this.#channel = channelOf(desk, this.#id);
    this.#channel.onmessage = ({ data }) => this.#hear(data);
    signal.addEventListener('abort', () => this.#channel.close());
    for (const store of [desk.playhead, desk.selection, desk.picking]) {
      store.addEventListener('change', () => this.value.length && this.#show(), { signal });
    }
    desk.observations.addEventListener('change', () => this.#select(this.#awaited), { signal });
    desk.selection.addEventListener(
      'change',
      () => {
        if (desk.selection.value !== null) this.#awaited = null; // the person has gone on to something else
      },
      { signal },
    );
    this.#channel.postMessage({ type: 'who' }); // after a reload its windows are still there
  }

  /** @param {string} part */
  has(part) {
    return this.value.includes(part);
  }

  /**
   * Opens the window of a part, or closes it.
   * @param {'viewer'|'wall'} part
   * @returns {boolean} false when the browser refuses to open it
   */
  toggle(part) {
    if (this.has(part)) {
      this.#channel.postMessage({ type: 'close', part });
      this.#remove(part); // also if the window has died without a word
      return true;
    }
    const { id } = this.#desk.inspection;
    const query = new URLSearchParams({ window: part, desk: this.#id });
    const opened = window.open(`/inspections/${id}?${query}`, `chainage-${part}-${id}-${this.#id}`, FEATURES);
    opened?.focus();
    return opened !== null;
  }

  /** @param {{type: string, part: string, frame: number, id: string|null, found: Found}} message */
  #hear({ type, part, frame, id, found }) {
    if (type === 'open') {
      if (!this.has(part)) this.set([...this.value, part]);
      this.#show();
    } else if (type === 'closed') this.#remove(part);
    else if (type === 'seek') this.#desk.seek(frame);
    else if (type === 'select') this.#select(id);
    else if (type === 'picked') this.#desk.picking.value?.(found);
    else if (type === 'unpicked') this.#desk.picking.set(null);
  }

  /** @param {string} part */
  #remove(part) {
    if (this.has(part)) this.set(this.value.filter((other) => other !== part));
  }

  /** @param {string|null} id */
  #select(id) {
    const { selection, observations } = this.#desk;
    const isThere = id === null || observations.find(id) !== null;
    if (id !== null && isThere && selection.value !== id) this.#desk.select(id);
    this.#awaited = isThere ? null : id;
  }

  #show() {
    const {
      playhead: { value: now },
      selection,
      picking,
    } = this.#desk;
    const playhead = { ...now, capturedMs: /** @type {number|null} */ (null) }; // that is by the clock of this page
    this.#channel.postMessage({
      type: 'shown',
      playhead,
      selection: selection.value,
      isPicking: picking.value !== null,
    });
  }
}

/**
 * The window's side: follows the play head and the selection of the desk, and moves them. Without a desk it stands alone.
 * @param {Desk} desk of the window
 * @param {'viewer'|'wall'} part
 * @param {AbortSignal} signal
 */
export function followDesk(desk, part, signal) {
  const channel = channelOf(desk, asked().get('desk'));
  const { playhead, selection, observations, picking } = desk;
  /** @type {string|null} */
  let selected = null; // on the desk
  let isPicking = false; // there
  const select = () => {
    if (selected === null || observations.find(selected)) selection.set(selected);
  };
  /** @param {Found} found */
  const pick = (found) => channel.postMessage({ type: 'picked', found });
  channel.onmessage = ({ data }) => {
    if (data.type === 'who') channel.postMessage({ type: 'open', part });
    if (data.type === 'close' && data.part === part) leave(desk);
    if (data.type !== 'shown') return;
    playhead.set(data.playhead);
    isPicking = data.isPicking;
    picking.set(isPicking ? pick : null);
    selected = data.selection;
    select();
  };
  desk.seek = (frame) => {
    playhead.set({ frame, row: desk.track.row(frame), isLive: false, capturedMs: null });
    channel.postMessage({ type: 'seek', frame });
  };
  observations.addEventListener('change', select, { signal });
  selection.addEventListener(
    'change',
    () => {
      if (selection.value === null || selection.value === selected) return;
      selected = selection.value;
      channel.postMessage({ type: 'select', id: selected });
    },
    { signal },
  );
  picking.addEventListener(
    'change',
    () => {
      if (picking.value === null && isPicking) channel.postMessage({ type: 'unpicked' });
    },
    { signal },
  );
  addEventListener('pagehide', () => channel.postMessage({ type: 'closed', part }), { signal });
  signal.addEventListener('abort', () => channel.close());
  channel.postMessage({ type: 'open', part });
}

/** Closes the window; a page that no script opened cannot be closed, so it becomes a desk. @param {Desk} desk */
function leave({ inspection }) {
  window.close();
  if (!window.closed) location.assign(`/inspections/${inspection.id}`);
}
