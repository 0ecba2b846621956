/**
 * Web Mercator, the projection of raster tiles: the world is a square of side 1, x eastwards from the
 * antimeridian and y southwards from 85° north. A view looks at a part of it in px, north upwards.
 */

import { M_PER_FT } from './units.js';

/** Side of a tile; the whole world at zoom 0. */
export const TILE_PX = 256;
/** Zoom at which a view comes closest: some 7 cm in a px. */
export const CLOSEST = 21;
/** Zoom at which a single point is shown, and the closest for a short line: 1.2 m and 0.3 m in a px. */
const NEAR_POINT = 17;
const NEAR_LINE = 19;
/** Beyond it the square ends. */
const MOST_LAT = 85.0511287798066;
/** WGS 84 */
const EQUATOR_M = 2 * Math.PI * 6378137;
const FT_PER_MI = 5280;

/**
 * @typedef {[number, number]} Point in the world; x may lie beyond 0 to 1, one turn further
 * @typedef {{x: number, y: number, zoom: number}} View its middle in the world; a px is halved by each zoom
 * @typedef {{width: number, height: number}} Size of what shows it, in px
 */

/** @param {number} value @param {number} least @param {number} most */
const clamped = (value, least, most) => Math.min(Math.max(value, least), most);

/** Returns x within one turn from `from` on. @param {number} x @param {number} [from] */
export const turned = (x, from = 0) => x - Math.floor(x - from);

/** Px in the side of the world. @param {number} zoom */
export const scaleAt = (zoom) => TILE_PX * 2 ** zoom;

/** @param {[number, number]} place longitude and latitude in degrees @returns {Point} */
export function toWorld([lon, lat]) {
  const sin = Math.sin((clamped(lat, -MOST_LAT, MOST_LAT) * Math.PI) / 180);
  return [lon / 360 + 0.5, 0.5 - Math.log((1 + sin) / (1 - sin)) / (4 * Math.PI)];
}

/** @param {Point} point @returns {[number, number]} longitude and latitude in degrees */
export const toDegrees = ([x, y]) => [
  (turned(x) - 0.5) * 360,
  (Math.atan(Math.sinh(Math.PI * (1 - 2 * y))) * 180) / Math.PI,
];

/**
 * Points of a line; one that crosses the antimeridian goes on beyond it and not back round the world.
 * @param {[number, number][]} line
 * @returns {Point[]}
 */
export function worldLine(line) {
  const points = line.map(toWorld);
  return points.map(([x, y]) => [turned(x, points[0][0] - 0.5), y]);
}

/**
 * Returns the middle of the widest part of the turn that holds none of these x: there the map is cut.
 * @param {number[]} xs
 */
export function seamOf(xs) {
  const sorted = xs.map((x) => turned(x)).sort((a, b) => a - b);
  if (sorted.length === 0) return 0;
  let [widest, seam] = [sorted[0] + 1 - sorted.at(-1), (sorted[0] + 1 + sorted.at(-1)) / 2];
  for (let i = 1; i < sorted.length; i += 1) {
    const gap = sorted[i] - sorted[i - 1];
    if (gap > widest) [widest, seam] = [gap, (sorted[i] + sorted[i - 1]) / 2];
  }
  return turned(seam);
}

/**
 * Returns the nearest view within the world: it has no poles, and never shows a place twice.
 * @param {View} view
 * @param {Size} size
 * @returns {View}
 */
export function limited({ x, y, zoom }, { width, height }) {
  const nearest = clamped(zoom, Math.log2(Math.max(width, height, 1) / TILE_PX), CLOSEST);
  const half = height / 2 / scaleAt(nearest);
  return { x: turned(x), y: clamped(y, half, 1 - half), zoom: nearest };
}

/**
 * Returns the view that shows all of some points.
 * @param {Point[]} points on one side of the seam
 * @param {Size} size
 * @param {number} margin px that stay free on every side
 */
export function fitted(points, size, margin) {
  let [left, right, top, bottom] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const [x, y] of points) {
    [left, right] = [Math.min(left, x), Math.max(right, x)];
    [top, bottom] = [Math.min(top, y), Math.max(bottom, y)];
  }
  const free = [size.width, size.height].map((px) => Math.max(px - 2 * margin, 1));
  const scale = Math.min(free[0] / (right - left), free[1] / (bottom - top));
  const zoom = Math.min(Math.log2(scale / TILE_PX), scale === Infinity ? NEAR_POINT : NEAR_LINE);
  return limited({ x: (left + right) / 2, y: (top + bottom) / 2, zoom }, size);
}

/**
 * Returns where a point is in a view, in px from its corner: its copy that is nearest to the middle.
 * @param {View} view
 * @param {Size} size
 * @param {Point} point
 * @returns {[number, number]}
 */
export function placeIn({ x, y, zoom }, { width, height }, point) {
  const scale = scaleAt(zoom);
  return [width / 2 + turned(point[0] - x, -0.5) * scale, height / 2 + (point[1] - y) * scale];
}

/**
 * Returns the point under a place of a view.
 * @param {View} view
 * @param {Size} size
 * @param {[number, number]} place
 * @returns {Point}
 */
export function pointAt({ x, y, zoom }, { width, height }, [px, py]) {
  const scale = scaleAt(zoom);
  return [x + (px - width / 2) / scale, y + (py - height / 2) / scale];
}

/**
 * Returns the view after its content was moved by some px.
 * @param {View} view
 * @param {Size} size
 * @param {[number, number]} by
 */
export function moved(view, size, [right, down]) {
  const scale = scaleAt(view.zoom);
  return limited({ ...view, x: view.x - right / scale, y: view.y - down / scale }, size);
}

/**
 * Returns the view enlarged by a factor; what is at `place` stays there.
 * @param {View} view
 * @param {Size} size
 * @param {number} factor
 * @param {[number, number]} place
 */
export function zoomed(view, size, factor, place) {
  const { zoom } = limited({ ...view, zoom: view.zoom + Math.log2(factor) }, size);
  const [x, y] = pointAt(view, size, place);
  const scale = scaleAt(zoom);
  const [right, down] = [place[0] - size.width / 2, place[1] - size.height / 2];
  return limited({ x: x - right / scale, y: y - down / scale, zoom }, size);
}

/** Metres on the ground in a px, at the latitude of the middle of the view. @param {View} view */
export const metresPerPx = ({ y, zoom }) => EQUATOR_M / Math.cosh(Math.PI * (1 - 2 * y)) / scaleAt(zoom);

/**
 * Returns the longest round length that fits.
 * @param {number} mPerPx
 * @param {number} mostPx
 * @param {'m'|'ft'} lengthUnit of the person
 * @returns {{px: number, value: number, unit: 'm'|'km'|'ft'|'mi'}}
 */
export function scaleBar(mPerPx, mostPx, lengthUnit) {
  const most = mPerPx * mostPx;
  const isLong = lengthUnit === 'm' ? most >= 1000 : most >= FT_PER_MI * M_PER_FT;
  /** @type {['m'|'km'|'ft'|'mi', number]} */
  const [unit, metres] =
    lengthUnit === 'm'
      ? [isLong ? 'km' : 'm', isLong ? 1000 : 1]
      : [isLong ? 'mi' : 'ft', isLong ? FT_PER_MI * M_PER_FT : M_PER_FT];
  const power = 10 ** Math.floor(Math.log10(most / metres));
  const value = [5, 2, 1].find((size) => size * power * metres <= most) * power;
  return { px: (value * metres) / mPerPx, value, unit };
}
