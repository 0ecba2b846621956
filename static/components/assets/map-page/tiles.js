/** Raster tiles below a map, from the server that the administrator has set. */

import { scaleAt, TILE_PX } from '../../../core/wall/mercator.js';

/** Tiles that are kept, most; those in view are half of it at most. */
const MOST_KEPT = 200;
/** Servers of tiles go no closer; farther in, their tiles are enlarged. */
const CLOSEST_TILES = 19;
/** While a tile is loaded, one up to so many zooms farther out stands in for it. */
const STAND_IN_ZOOMS = 4;

/** @typedef {{image: HTMLImageElement, state: 'loading'|'ready'|'failed'}} Tile */

/**
 * Keeps the tiles that were shown last. A tile that cannot be loaded leaves the background plain and is not
 * asked for again while it is kept.
 */
export class Tiles {
  #template;
  #onChange;
  #onPaint;
  /** @type {Map<string, Tile>} longest unused first */
  #kept = new Map();

  /**
   * @param {string} template address with {z}, {x} and {y}
   * @param {() => void} onChange a tile has arrived, or could not be loaded
   * @param {(isFaulty: boolean) => void} onPaint isFaulty: one of those in view could not be loaded
   */
  constructor(template, onChange, onPaint) {
    this.#template = template;
    this.#onChange = onChange;
    this.#onPaint = onPaint;
  }

  /** Draws the tiles of a view, and loads those that are missing. */
  paint({ context, view, size }) {
    const { zoom, tiles } = tilesOf(view, size);
    const wanted = new Set();
    let isFaulty = false;
    for (const { column, row, left, top, side } of tiles) {
      wanted.add(keyOf(zoom, column, row));
      const tile = this.#tile(zoom, column, row);
      isFaulty ||= tile.state === 'failed';
      if (tile.state === 'ready') context.drawImage(tile.image, left, top, side, side);
      else this.#standIn(context, { zoom, column, row, left, top, side });
    }
    this.#forget(wanted);
    this.#onPaint(isFaulty);
  }

  /** Drops the tiles that could not be loaded, so that they are asked for again. */
  dropFailed() {
    for (const [key, { state }] of this.#kept) if (state === 'failed') this.#kept.delete(key);
  }

  #tile(zoom, column, row) {
    const key = keyOf(zoom, column, row);
    const tile = this.#kept.get(key) ?? this.#load(zoom, column, row);
    this.#kept.delete(key); // so that it is the newest of the map
    this.#kept.set(key, tile);
    return tile;
  }

  #load(zoom, column, row) {
    const image = new Image(TILE_PX, TILE_PX);
    /** @type {Tile} */
    const tile = { image, state: 'loading' };
    image.onload = () => {
      tile.state = 'ready';
      this.#onChange();
    };
    image.onerror = () => {
      tile.state = 'failed';
      this.#onChange();
    };
    image.src = this.#template.replace('{z}', zoom).replace('{x}', column).replace('{y}', row);
    return tile;
  }

  /** Draws the part of a tile farther out that shows the same. */
  #standIn(context, { zoom, column, row, left, top, side }) {
    for (let out = 1; out <= Math.min(STAND_IN_ZOOMS, zoom); out += 1) {
      const tile = this.#kept.get(keyOf(zoom - out, column >> out, row >> out));
      if (tile?.state !== 'ready') continue;
      const { naturalWidth: width } = tile.image;
      const part = width / 2 ** out;
      const [x, y] = [column, row].map((number) => (number % 2 ** out) * part);
      context.drawImage(tile.image, x, y, part, part, left, top, side, side);
      return;
    }
  }

  /** Ends what is loaded and no longer wanted, and drops what was shown long ago. */
  #forget(wanted) {
    for (const [key, { image, state }] of this.#kept) {
      const isTooMany = this.#kept.size > MOST_KEPT;
      if (wanted.has(key) || (state !== 'loading' && !isTooMany)) continue;
      image.onload = image.onerror = null;
      image.src = '';
      this.#kept.delete(key);
    }
  }
}

const keyOf = (zoom, column, row) => `${zoom}/${column}/${row}`;

/** Returns the tiles of a view at the zoom that fits it best, farther out where they would be too many. */
function tilesOf(view, size) {
  let zoom = Math.min(Math.max(Math.round(view.zoom), 0), CLOSEST_TILES);
  const sideAt = (level) => scaleAt(view.zoom) / 2 ** level;
  const numberAt = (level) => (size.width / sideAt(level) + 2) * (size.height / sideAt(level) + 2);
  while (zoom > 0 && numberAt(zoom) > MOST_KEPT / 2) zoom -= 1;
  const side = sideAt(zoom);
  const [west, north] = [view.x - size.width / 2 / scaleAt(view.zoom), view.y - size.height / 2 / scaleAt(view.zoom)];
  const columns = 2 ** zoom;
  const [first, top] = [Math.floor(west * columns), Math.max(0, Math.floor(north * columns))];
  const [originX, originY] = [-west * columns * side, -north * columns * side];
  const tiles = [];
  for (let row = top; row < columns && originY + row * side < size.height; row += 1) {
    for (let i = first; originX + i * side < size.width; i += 1) {
      const [left, above] = [Math.floor(originX + i * side), Math.floor(originY + row * side)];
      tiles.push({ column: ((i % columns) + columns) % columns, row, left, top: above, side: Math.ceil(side) + 1 });
    }
  }
  return { zoom, tiles };
}
