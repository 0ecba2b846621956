/** Where the assets of the map lie in the world, and which are so near each other that they are shown as one. */

import { scaleAt, seamOf, turned, worldLine } from '../../../core/wall/mercator.js';

/** Px across and down within which marks would overlap: those of clusters are wide. */
const ACROSS_PX = 50;
const DOWN_PX = 30;
/** Marks are gathered anew at each half zoom. */
const LEVELS_PER_ZOOM = 2;
/** More cells than a side of the world has. */
const CELLS = 2 ** 26;

/**
 * @typedef {object} Place an asset in the world
 * @property {Api['MappedAssetOut']} asset
 * @property {import('../../../core/wall/mercator.js').Point[]} points of its line
 * @property {number} x half-way along it
 * @property {number} y
 * @property {number} reach farthest distance of a point from there
 *
 * @typedef {object} Cluster places around the worst of them
 * @property {number} x of the worst
 * @property {number} y
 * @property {number|null} severity
 * @property {Place[]} places the worst first
 */

/**
 * Returns the places of assets, all on one side of the seam, in the same order.
 * @param {Api['MappedAssetOut'][]} assets
 * @returns {Place[]}
 */
export function placesOf(assets) {
  const lines = assets.map(({ line }) => worldLine(/** @type {[number, number][]} */ (line)));
  const seam = seamOf(lines.map(([[x]]) => x));
  return assets.map((asset, i) => placeOf(asset, lines[i], seam));
}

function placeOf(asset, line, seam) {
  const shift = turned(line[0][0], seam) - line[0][0];
  const points = line.map(([x, y]) => [x + shift, y]);
  const [x, y] = halfWay(points);
  return { asset, points, x, y, reach: Math.max(...points.map((point) => apart(point, [x, y]))) };
}

const apart = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by);

/** Returns the point half-way along a line. */
function halfWay(points) {
  const lengths = points.slice(1).map((point, i) => apart(point, points[i]));
  let left = lengths.reduce((sum, length) => sum + length, 0) / 2;
  for (const [i, length] of lengths.entries()) {
    if (length > 0 && left <= length) return between(points[i], points[i + 1], left / length);
    left -= length;
  }
  return points[0];
}

const between = ([ax, ay], [bx, by], share) => [ax + (bx - ax) * share, ay + (by - ay) * share];

/** The level of clusters that a zoom shows. */
export const levelOf = (zoom) => Math.floor(zoom * LEVELS_PER_ZOOM) / LEVELS_PER_ZOOM;

/**
 * Gathers places that would overlap. A place joins the nearest mark within reach, and the worst come
 * first: so each mark stands at the worst of its places. Linear in the number of places.
 * @param {Place[]} places the worst first
 * @param {number} level as of `levelOf`
 * @returns {Cluster[]}
 */
export function clustersOf(places, level) {
  const [across, down] = [ACROSS_PX, DOWN_PX].map((px) => px / scaleAt(level));
  /** @type {Map<number, Cluster[]>} clusters by the cell of a grid as large as their reach */
  const cells = new Map();
  const clusters = [];
  for (const place of places) {
    const [column, row] = [Math.floor(place.x / across), Math.floor(place.y / down)];
    const cluster = nearest(cells, column, row, place, across, down);
    if (cluster) {
      cluster.places.push(place);
      continue;
    }
    const { x, y, asset } = place;
    const made = { x, y, severity: asset.worst_severity, places: [place] };
    clusters.push(made);
    const key = column * CELLS + row;
    if (cells.has(key)) cells.get(key).push(made);
    else cells.set(key, [made]);
  }
  return clusters;
}

function nearest(cells, column, row, { x, y }, across, down) {
  let [found, least] = [null, 1];
  for (let i = column - 1; i <= column + 1; i += 1) {
    for (let j = row - 1; j <= row + 1; j += 1) {
      for (const cluster of cells.get(i * CELLS + j) ?? []) {
        const distance = Math.max(Math.abs(cluster.x - x) / across, Math.abs(cluster.y - y) / down);
        if (distance < least) [found, least] = [cluster, distance];
      }
    }
  }
  return found;
}
