/** The unrolled wall: its tiles, and their pictures, decoded as large as needed. */

import { ApiError, blob, get } from '../server/api.js';
import { Store } from '../page/store.js';

/** Decoded pictures may take as many pixels as this many whole tiles. */
const WHOLE_TILES_KEPT = 40;
const LOADS_AT_ONCE = 6;

/**
 * @typedef {Api['WallTileOut']} Tile
 * @typedef {{tile: Tile, size: [number, number]}} Wish
 */

/** A store of the layout, null until it is known. @extends {Store<Api['UnrolledOut']|null>} */
export class Unrolled extends Store {
  #path;
  #signal;

  /** @param {string} inspection @param {AbortSignal} signal */
  constructor(inspection, signal) {
    super(null);
    this.#path = `/api/inspections/${inspection}/unrolled`;
    this.#signal = signal;
  }

  async load() {
    const layout = await this.#ask();
    if (JSON.stringify(layout) !== JSON.stringify(this.value)) this.set(layout);
  }

  /** @param {Tile} tile */
  pathOf({ index, revision }) {
    return `${this.#path}/${index}.jpg?v=${revision}`;
  }

  /**
   * Fetches the layout; if there is none yet, or the rig sees no wall, there is nothing to show, which is
   * no fault.
   * @returns {Promise<Api['UnrolledOut']|null>}
   */
  async #ask() {
    try {
      return await get(this.#path, this.#signal);
    } catch (error) {
      if (error instanceof ApiError && (error.status === 404 || error.status === 422)) return null;
      throw error;
    }
  }
}

/**
 * Decoded pictures of the tiles requested last. A distant tile is decoded small, so that a whole run takes
 * no more memory than its visible part. Fires `change` when a picture has arrived.
 */
export class TilePictures extends EventTarget {
  #unrolled;
  #signal;
  /** By index, the one drawn longest ago first. @type {Map<number, {revision: number, bitmap: ImageBitmap}>} */
  #kept = new Map();
  /** @type {Wish[]} */
  #wanted = [];
  /** @type {Set<number>} */
  #loading = new Set();
  /** Addresses that failed; a tile gets a new address when it changes. @type {Set<string>} */
  #failed = new Set();

  /** @param {Unrolled} unrolled @param {AbortSignal} signal */
  constructor(unrolled, signal) {
    super();
    this.#unrolled = unrolled;
    this.#signal = signal;
    signal.addEventListener('abort', () => this.clear());
  }

  /** Decoded pixels of all pictures together. */
  get pixels() {
    let sum = 0;
    for (const { bitmap } of this.#kept.values()) sum += bitmap.width * bitmap.height;
    return sum;
  }

  get count() {
    return this.#kept.size;
  }

  clear() {
    for (const { bitmap } of this.#kept.values()) bitmap.close();
    this.#kept.clear();
    this.#wanted = [];
  }

  /**
   * Requests the visible tiles, the most important first; tiles that are no longer wanted are not loaded.
   * @param {Tile[]} tiles
   * @param {number} widthPx how large they are drawn
   * @param {number} heightPx
   */
  want(tiles, widthPx, heightPx) {
    const { width_px: width, height_px: height } = this.#unrolled.value;
    /** @type {[number, number]} */
    const size = [enough(widthPx, width), enough(heightPx, height)];
    this.#wanted = tiles.filter((tile) => !this.#isGood(tile, size)).map((tile) => ({ tile, size }));
    this.#loadNext();
  }

  /** Returns the newest picture of a tile that has arrived, of any size, or null. @param {Tile} tile */
  get(tile) {
    const entry = this.#kept.get(tile.index);
    if (!entry) return null;
    this.#kept.delete(tile.index);
    this.#kept.set(tile.index, entry);
    return entry.bitmap;
  }

  /** @param {Tile} tile @param {[number, number]} size */
  #isGood(tile, [width, height]) {
    const kept = this.#kept.get(tile.index);
    const isSharp = kept && kept.bitmap.width >= width && kept.bitmap.height >= height;
    return isSharp && kept.revision === tile.revision;
  }

  #loadNext() {
    while (this.#loading.size < LOADS_AT_ONCE) {
      const next = this.#wanted.findIndex((wish) => this.#isOpen(wish));
      if (next < 0) return;
      const [{ tile, size }] = this.#wanted.splice(next, 1);
      this.#load(tile, size);
    }
  }

  /** @param {Wish} wish */
  #isOpen({ tile, size }) {
    if (this.#loading.has(tile.index) || this.#failed.has(this.#unrolled.pathOf(tile))) return false;
    // It may have arrived since it was requested.
    return !this.#isGood(tile, size);
  }

  /** @param {Tile} tile @param {[number, number]} size */
  async #load(tile, [resizeWidth, resizeHeight]) {
    this.#loading.add(tile.index);
    const path = this.#unrolled.pathOf(tile);
    try {
      const picture = await blob(path, this.#signal);
      /** @type {ImageBitmapOptions} */
      const options = { resizeWidth, resizeHeight, resizeQuality: 'medium' };
      this.#keep(tile, await createImageBitmap(picture, options));
    } catch (error) {
      if (error.name === 'AbortError') return;
      // Missing (now), or not readable: the strip shows a gap, and tries again elsewhere.
      if (!(error instanceof ApiError || error.name === 'InvalidStateError')) throw error;
      if (!error.isTemporary) this.#failed.add(path);
    } finally {
      this.#loading.delete(tile.index);
    }
    this.#loadNext();
  }

  /** @param {Tile} tile @param {ImageBitmap} bitmap */
  #keep({ index, revision }, bitmap) {
    if (this.#signal.aborted) {
      bitmap.close();
      return;
    }
    this.#kept.get(index)?.bitmap.close();
    this.#kept.delete(index);
    this.#kept.set(index, { revision, bitmap });
    this.#drop();
    this.dispatchEvent(new Event('change'));
  }

  #drop() {
    const { width_px: width, height_px: height } = this.#unrolled.value;
    let excess = this.pixels - WHOLE_TILES_KEPT * width * height;
    for (const [index, { bitmap }] of this.#kept) {
      if (excess <= 0) return;
      excess -= bitmap.width * bitmap.height;
      bitmap.close();
      this.#kept.delete(index);
    }
  }
}

/**
 * Returns the smallest halving of `full` that is not smaller than the drawn size.
 * @param {number} drawn
 * @param {number} full
 */
function enough(drawn, full) {
  let size = full;
  while (size / 2 >= drawn && size > 2) size /= 2;
  return Math.ceil(size);
}
